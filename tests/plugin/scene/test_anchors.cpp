// Contacts of a node that is anchored to a rigid body act on that body.
#include <BulletCollision/CollisionShapes/btBoxShape.h>
#include <BulletCollision/CollisionShapes/btEmptyShape.h>

#include <cmath>

#include "plugin/support/obstacle_worlds.h"
#include "plugin/support/worlds.h"
#include "support/catch.h"

using namespace lazyccd;
using namespace lazyccd::test;

namespace {

// A flat cloth of 1 kg. Its nodes are free, or all are anchored to boxes at some distance, to one
// box after the other.
struct Board {
  btSoftBody* cloth;
  std::vector<btRigidBody*> boxes;
  double mass;  // of each box

  // `box_mass`: kg; 0: no boxes. `box_height`: height of the boxes above the cloth, metres.
  Board(ObstacleWorld& w, double height, double speed_down, double box_mass, double box_height,
        int box_count = 1)
      : mass(box_mass) {
    auto sheet = scenes::make_cloth(w.info(), 5, 5, 1, [&](double u, double v) {
      const double aside = 0.1 * height;
      return btVector3(static_cast<btScalar>(0.5 * (u - 0.5) + aside),
                       static_cast<btScalar>(height), static_cast<btScalar>(0.5 * (v - 0.5)));
    });
    cloth = w.add(std::move(sheet));
    cloth->m_cfg.kDP = 0;
    const btVector3 velocity(0, static_cast<btScalar>(-speed_down), 0);
    cloth->setVelocity(velocity);
    if (mass == 0) return;
    const btVector3 half(btScalar(0.1), btScalar(0.02), btScalar(0.1));
    for (int i = 0; i < box_count; ++i) {
      const btVector3 at(static_cast<btScalar>(0.3 * i), static_cast<btScalar>(height + box_height),
                         0);
      boxes.push_back(w.add(std::make_unique<btBoxShape>(half), at, mass));
      boxes.back()->setActivationState(DISABLE_DEACTIVATION);
      boxes.back()->setDamping(0, 0);
      boxes.back()->setLinearVelocity(velocity);
    }
    for (int i = 0; i < cloth->m_nodes.size(); ++i) {
      btRigidBody* const box = boxes[static_cast<std::size_t>(i % box_count)];
      if (w.is_rigid()) {
        cloth->appendAnchor(i, box);
      } else {
        cloth->appendDeformableAnchor(i, box);
      }
    }
  }

  btVector3 momentum() const {
    btVector3 sum(0, 0, 0);
    for (int i = 0; i < cloth->m_nodes.size(); ++i)
      sum += cloth->m_nodes[i].m_v / cloth->m_nodes[i].m_im;
    for (const btRigidBody* box : boxes)
      sum += static_cast<btScalar>(mass) * box->getLinearVelocity();
    return sum;
  }
  void follow(const Board& twin) const {
    for (int i = 0; i < cloth->m_nodes.size(); ++i) {
      btSoftBody::Node& node = cloth->m_nodes[i];
      node.m_x = twin.cloth->m_nodes[i].m_x;
      node.m_q = twin.cloth->m_nodes[i].m_q;
      node.m_v = twin.cloth->m_nodes[i].m_v;
    }
    for (std::size_t i = 0; i < boxes.size(); ++i) {
      boxes[i]->setCenterOfMassTransform(twin.boxes[i]->getCenterOfMassTransform());
      boxes[i]->setLinearVelocity(twin.boxes[i]->getLinearVelocity());
      boxes[i]->setAngularVelocity(twin.boxes[i]->getAngularVelocity());
    }
  }
  double height() const {
    double least = HUGE_VAL;
    for (int i = 0; i < cloth->m_nodes.size(); ++i)
      least = std::min(least, static_cast<double>(cloth->m_nodes[i].m_x.y()));
    return least;
  }
};

// Two boards, or a cloth and a board, that collide.
struct Meeting {
  ObstacleWorld world;
  Board lower, upper;

  Meeting(World kind, const bullet::SolverOptions& options, double mass, double mass_of_other,
          int boxes_each = 1)
      : world(kind, 0, options),
        lower(world, 0, 0, mass, -0.3, boxes_each),
        upper(world, 0.1, 5, mass_of_other, 0.3, boxes_each) {}

  btVector3 momentum() const { return lower.momentum() + upper.momentum(); }
};

}  // namespace

namespace {

// Checks that contacts keep linear and angular momentum. `alone` is the same scene without
// contacts: Bullet's own step loses some angular momentum.
void check_momentum(Meeting& meeting, Meeting& alone) {
  for (const Board* board : {&alone.lower, &alone.upper}) {
    board->cloth->setCollisionFlags(board->cloth->getCollisionFlags() |
                                    btCollisionObject::CF_NO_CONTACT_RESPONSE);
  }
  const double before = static_cast<double>(meeting.momentum().length());
  for (int step = 0; step < 20; ++step) {
    alone.lower.follow(meeting.lower);
    alone.upper.follow(meeting.upper);
    alone.world.steps(1);
    meeting.world.steps(1);
    const btVector3 lost = alone.momentum() - meeting.momentum();
    CHECK_THAT(static_cast<double>(lost.length()), Matchers::WithinAbs(0, 1e-5 * before));
  }
  CHECK(static_cast<double>(meeting.lower.momentum().length()) > 0.05 * before);
  CHECK(meeting.world.total().energy_gained < 1e-6);
  CHECK(meeting.world.total().unresolved == 0);
}

}  // namespace

TEST_CASE("an impulse on an anchored node acts on the rigid body without loss of momentum") {
  const World world = GENERATE(World::rigid, World::deformable);
  const double mass = GENERATE(0.1, 10.0);
  const double mass_of_other = GENERATE(0.0, 1.0);
  // Impulses, impact zones, and zones held at their start.
  const int means = GENERATE(0, 1, 2);
  CAPTURE(world == World::rigid, mass, mass_of_other, means);
  bullet::SolverOptions options;
  if (means > 0) options.max_impulse_rounds = 0;
  if (means > 1) options.max_zone_rounds = 0;
  Meeting meeting(world, options, mass, mass_of_other), alone(world, options, mass, mass_of_other);
  check_momentum(meeting, alone);
  if (means < 2) CHECK(meeting.world.total().failsafe_holds == 0);
}

TEST_CASE("the rigid body of an anchor gets the impulse though it collides with nothing") {
  // Cloths do not collide with rigid bodies; the boxes have no triangles; or they have no contacts.
  const int why = GENERATE(0, 1, 2);
  CAPTURE(why);
  Meeting meeting(World::deformable, {}, 1, 1), alone(World::deformable, {}, 1, 1);
  btEmptyShape empty;
  for (Meeting* m : {&meeting, &alone}) {
    for (const Board* board : {&m->lower, &m->upper}) {
      if (why == 0) board->cloth->m_cfg.collisions = btSoftBody::fCollision::VF_DD;
      if (why == 1) board->boxes[0]->setCollisionShape(&empty);
      if (why == 2)
        board->boxes[0]->setCollisionFlags(board->boxes[0]->getCollisionFlags() |
                                           btCollisionObject::CF_NO_CONTACT_RESPONSE);
    }
  }
  check_momentum(meeting, alone);
}

TEST_CASE("the four nodes of a contact may be anchored to four rigid bodies") {
  const int boxes_each = GENERATE(2, 3, 4);
  CAPTURE(boxes_each);
  const bullet::SolverOptions options;
  Meeting meeting(World::deformable, options, 10, 20, boxes_each);
  Meeting alone(World::deformable, options, 10, 20, boxes_each);
  check_momentum(meeting, alone);
}

TEST_CASE("an anchored node stops its rigid body at an immovable body") {
  const World world = GENERATE(World::rigid, World::deformable);
  CAPTURE(world == World::rigid);
  ObstacleWorld w(world, 10);
  w.add(std::make_unique<btBoxShape>(btVector3(1, btScalar(0.1), 1)),
        btVector3(0, btScalar(-0.1), 0));
  const Board board(w, 0.2, 1, 1, 0.1);
  w.steps(230, 1.0 / 240);
  const double height = board.height();
  const btVector3 place = board.boxes[0]->getCenterOfMassPosition();
  w.steps(10, 1.0 / 240);
  CHECK_THAT(height, Matchers::WithinAbs(0.02, 0.011));
  CHECK_THAT(board.height(), Matchers::WithinAbs(height, 1e-4));
  CHECK((board.boxes[0]->getCenterOfMassPosition() - place).length() < btScalar(1e-4));
  CHECK(w.total().failsafe_holds == 0);
}
