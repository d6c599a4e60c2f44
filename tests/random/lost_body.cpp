#include "lost_body.h"

#include <BulletSoftBody/btDeformableLinearElasticityForce.h>
#include <BulletSoftBody/btDeformableMultiBodyDynamicsWorld.h>

#include <chrono>
#include <cmath>
#include <limits>
#include <memory>

#include "scenes/meshes/cloth.h"
#include "scenes/meshes/shapes.h"
#include "scenes/meshes/solid.h"

namespace lazyccd::test {
namespace {

constexpr double beside = 40;  // m: farther than any scene reaches
constexpr int losing_step = 3;

std::vector<double> places(const scenes::PhysicsWorld& world, const btSoftBody* without) {
  std::vector<double> all;
  const auto add = [&all](const btVector3& x) {
    for (int k = 0; k < 3; ++k) all.push_back(static_cast<double>(x[k]));
  };
  for (const auto& body : world.bodies()) {
    if (body.get() == without) continue;
    for (int i = 0; i < body->m_nodes.size(); ++i) add(body->m_nodes[i].m_x);
  }
  for (const scenes::RigidBody& rigid : world.rigid_bodies())
    add(rigid.body->getWorldTransform().getOrigin());
  return all;
}

std::unique_ptr<btSoftBody> make_patch(scenes::PhysicsWorld& world, double height) {
  return scenes::make_cloth(world.info(), 4, 4, 0.1, [height](double u, double v) {
    return scenes::vector(beside + 0.3 * u, height, 0.3 * v);
  });
}

std::unique_ptr<btSoftBody> make_cube(scenes::PhysicsWorld& world) {
  return scenes::make_solid(world.info(), 1, 1, [](double u, double v, double w) {
    return scenes::vector(beside + u, v, w);
  });
}

// One run, and the time of its steps.
class Run {
 public:
  Run(const scenes::SceneInfo& info, const scenes::Parameters& parameters)
      : scene_(scenes::set_up(info, parameters)) {}

  void lose(Loss loss) {
    loss_ = loss;
    scenes::PhysicsWorld& world = *scene_.world;
    const bool is_deformable = world.options().world == scenes::World::deformable;
    switch (loss) {
      case Loss::falls:
      case Loss::not_finite:
        add(make_patch(world, 0));
        break;
      case Loss::fell_minutes: {
        constexpr double gravity = 9.81, seconds = 180;
        add(make_patch(world, -gravity / 2 * seconds * seconds));
        lost_->setVelocity(scenes::vector(0, -gravity * seconds, 0));
        break;
      }
      case Loss::inverted: {
        add(make_cube(world));
        for (int i = 0; i < lost_->m_tetras.size(); ++i) {
          btSoftBody::Tetra& tetra = lost_->m_tetras[i];
          if (tetra.m_element_measure > 0) std::swap(tetra.m_n[0], tetra.m_n[1]);
        }
        lost_->initializeDmInverse();
        if (is_deformable) act_with_elasticity(1e4, 0.01);
        break;
      }
      case Loss::explodes: {
        add(make_cube(world));
        lost_->m_cfg.kPR = btScalar(1e12);
        for (int i = 0; i < lost_->m_tetras.size(); ++i) {
          btSoftBody::Tetra& tetra = lost_->m_tetras[i];
          if (tetra.m_element_measure < 0) std::swap(tetra.m_n[0], tetra.m_n[1]);
        }
        lost_->initializeDmInverse();
        lost_->m_nodes[0].m_x += scenes::vector(-0.1, 0.02, 0.03);
        if (is_deformable) act_with_elasticity(1e9, 0);
        break;
      }
    }
  }

  std::vector<double> end() {
    using Clock = std::chrono::steady_clock;
    Clock::duration spent{};
    for (int step = 0; step < scene_.steps; ++step) {
      if (lost_ && loss_ == Loss::not_finite && step == losing_step) {
        const btScalar nan = std::numeric_limits<btScalar>::quiet_NaN();
        lost_->m_nodes[5].m_x.setX(nan);
        lost_->m_nodes[5].m_v.setX(nan);
      }
      const Clock::time_point begin = Clock::now();
      scene_.world->step();
      spent += Clock::now() - begin;
    }
    ms_per_step = std::chrono::duration<double, std::milli>(spent).count() / scene_.steps;
    return places(*scene_.world, lost_);
  }

  std::string status() const { return scene_.world->status(); }
  double ms_per_step = 0;

 private:
  void add(std::unique_ptr<btSoftBody> body) {
    lost_ = body.get();
    scene_.world->add(std::move(body));
  }
  void act_with_elasticity(double stiffness, double damping) {
    force_ = std::make_unique<btDeformableLinearElasticityForce>(static_cast<btScalar>(stiffness),
                                                                 static_cast<btScalar>(stiffness),
                                                                 static_cast<btScalar>(damping));
    static_cast<btDeformableMultiBodyDynamicsWorld&>(scene_.world->dynamics())
        .addForce(lost_, force_.get());
  }

  std::unique_ptr<btDeformableLagrangianForce> force_;  // outlives the world
  scenes::Scene scene_;
  btSoftBody* lost_ = nullptr;
  Loss loss_ = Loss::falls;
};

}  // namespace

const char* name_of(Loss loss) {
  switch (loss) {
    case Loss::falls:
      return "falls";
    case Loss::fell_minutes:
      return "fell-minutes";
    case Loss::not_finite:
      return "not-finite";
    case Loss::inverted:
      return "inverted";
    case Loss::explodes:
      return "explodes";
  }
  return "";
}

LostBodyReport run_with_lost_body(const scenes::SceneInfo& info,
                                  const scenes::Parameters& parameters, Loss loss) {
  LostBodyReport report;
  Run without(info, parameters), with(info, parameters);
  with.lose(loss);
  const std::vector<double> expected = without.end(), places = with.end();
  report.is_same = places == expected;
  for (std::size_t i = 0; i < places.size(); ++i) {
    const double apart = std::abs(places[i] - expected[i]);
    report.farthest = apart <= report.farthest ? report.farthest : apart;  // NaN counts
  }
  report.thickness = 2 * parameters.margin.value_or(info.margin);
  report.ms_per_step = with.ms_per_step;
  report.ms_per_step_without = without.ms_per_step;
  report.status = with.status();
  return report;
}

}  // namespace lazyccd::test
