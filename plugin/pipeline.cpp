#include "pipeline.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <exception>

#include "pair_rules.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {
namespace {

using Clock = std::chrono::steady_clock;

double ms_since(Clock::time_point start) {
  return std::chrono::duration<double, std::milli>(Clock::now() - start).count();
}

}  // namespace

Pipeline::Pipeline(const Options& options)
    : options_(options),
      journal_(options.on_message),
      response_(options, [this](std::int32_t a, std::int32_t b) {
        if (options_.thickness >= 0) return options_.thickness;
        return topology_.bodies()[a].margin + topology_.bodies()[b].margin;
      }) {}

bool Pipeline::queue_pair(const btSoftBody* a, const btSoftBody* b) noexcept {
  if (!works_ || is_cluster_pair(*a, *b) || !scene_.takes(a) || !scene_.takes(b)) return false;
  ++queued_;
  return true;
}

void Pipeline::begin_step(const Bodies& bodies) noexcept {
  for (int i = 0; i < bodies.size(); ++i) {
    // Bullet clears the mark of active bodies only; of the others it is part of the scene's stamp.
    if (bodies[i]->m_bUpdateRtCst && bodies[i]->isActive()) scene_.invalidate();
  }
  if (options_.rigid_obstacles) obstacles_.begin_step(bodies);
}

bool Pipeline::run(const Bodies& bodies, double seconds, const Fill& fill) noexcept {
  step_ = StepStats();
  step_.steps = 1;
  step_.queued_pairs = queued_;
  queued_ = 0;
  contacts_.clear();
  silent_.clear();
  responded_ = false;
  try {
    const Clock::time_point start = Clock::now();
    gather(bodies, fill);
    step_.ms_gather = ms_since(start);
    if (scene_.vertex_count() > 0) {
      const Clock::time_point gathered = Clock::now();
      std::vector<Contact> contacts = detect(motion_.starts(), motion_.ends());
      responded_ = !contacts.empty();
      if (responded_) {
        const auto detect_again = [this](const Positions& x0, const Positions& x1) {
          return detect(x0, x1);
        };
        response_.run(std::move(contacts), detect_again, motion_, step_);
      }
      collect_contacts(seconds);
      step_.ms_response = ms_since(gathered) - step_.ms_detect;
    }
    works_ = true;
  } catch (const std::exception& error) {
    works_ = false;
    contacts_.clear();
    step_.missed_steps = 1;
    journal_.say(error.what(), std::string("the step goes on without LazyCCD: ") + error.what());
  }
  total_ += step_;
  return works_;
}

void Pipeline::gather(const Bodies& bodies, const Fill& fill) {
  scene_.readmit(bodies);
  if (!detector_) detector_ = std::make_unique<Detector>(options_.detector);
  bool changed = false;
  do {
    changed = scene_.update(bodies, journal_) || changed;
    gather_soft(fill);
  } while (refuse_non_finite());
  if (options_.rigid_obstacles) {
    AxisBox swept = AxisBox::empty();
    for (const SoftScene::BodyRecord& record : scene_.bodies()) {
      if (!Obstacles::meets_obstacles(*record.body)) continue;
      const std::size_t first = 3 * static_cast<std::size_t>(record.first_vertex);
      const std::size_t last = first + 3 * static_cast<std::size_t>(record.vertex_count);
      for (std::size_t i = first; i < last; i += 3) {
        swept.add(btVector3(motion_.start[i], motion_.start[i + 1], motion_.start[i + 2]));
        swept.add(btVector3(motion_.end[i], motion_.end[i + 1], motion_.end[i + 2]));
      }
    }
    changed = obstacles_.update(bodies, swept, journal_) || changed;
  }
  if (topology_.update(scene_, obstacles_, changed) && scene_.vertex_count() > 0) {
    try {
      detector_->set_topology(topology_.topology());
    } catch (...) {
      scene_.invalidate();
      throw;
    }
  }
  gather_obstacles();
}

void Pipeline::gather_soft(const Fill& fill) {
  const std::size_t count = static_cast<std::size_t>(scene_.vertex_count());
  motion_.start.resize(3 * count);
  motion_.end.resize(3 * count);
  motion_.inverse_mass.resize(count);
  for (std::size_t i = 0; i < count; ++i) {
    motion_.inverse_mass[i] = static_cast<double>(scene_.node(static_cast<std::int32_t>(i)).m_im);
  }
  fill(scene_, motion_);
}

void Pipeline::gather_obstacles() {
  motion_.first_vertex.clear();
  for (const StepTopology::BodyRecord& body : topology_.bodies()) {
    motion_.first_vertex.push_back(body.first_vertex);
    if (body.soft) continue;
    const Obstacles::Record& record = obstacles_.records()[body.obstacle];
    for (std::int32_t i = 0; i < record.vertex_count; ++i) {
      const btVector3& local = obstacles_.local()[record.first_vertex + i];
      const btVector3 start = record.start * local, end = record.end * local;
      for (int k = 0; k < 3; ++k) {
        motion_.start.push_back(start[k]);
        motion_.end.push_back(end[k]);
      }
      motion_.inverse_mass.push_back(0);
    }
  }
  motion_.first_vertex.push_back(topology_.vertex_count());
}

bool Pipeline::refuse_non_finite() {
  bool refused = false;
  for (const SoftScene::BodyRecord& record : scene_.bodies()) {
    for (std::int32_t v = record.first_vertex; v < record.first_vertex + record.vertex_count; ++v) {
      const std::size_t at = 3 * static_cast<std::size_t>(v);
      bool finite = true;
      for (std::size_t k = at; k < at + 3; ++k) {
        finite = finite && std::isfinite(motion_.start[k]) && std::isfinite(motion_.end[k]);
      }
      if (finite) continue;
      scene_.refuse(record.body);
      refused = true;
      const std::string body = std::to_string(record.world_index);
      journal_.say("finite " + body, "soft body " + body + ", node " +
                                         std::to_string(scene_.node_index(v)) +
                                         ": the position is not finite; the body is left out of "
                                         "collision detection until it is");
      break;
    }
  }
  return refused;
}

std::vector<Contact> Pipeline::detect(const Positions& start, const Positions& end) {
  const Clock::time_point begin = Clock::now();
  std::vector<Contact> answered;
  for (const Contact& contact : detector_->detect(start, end)) {
    if (is_anchored(contact)) continue;
    const bool responds =
        topology_.bodies()[contact.body_a].responds && topology_.bodies()[contact.body_b].responds;
    const bool movable =
        std::any_of(contact.vertices.begin(), contact.vertices.end(),
                    [this](std::int32_t v) { return motion_.inverse_mass[v] > 0; });
    if (responds && movable) {
      answered.push_back(contact);
    } else if (step_.detections == 0) {
      silent_.push_back(contact);
    }
  }
  ++step_.detections;
  step_.ms_detect += ms_since(begin);
  return answered;
}

bool Pipeline::is_anchored(const Contact& contact) const {
  const StepTopology::BodyRecord& a = topology_.bodies()[contact.body_a];
  const StepTopology::BodyRecord& b = topology_.bodies()[contact.body_b];
  if (a.soft && b.soft) return false;
  const btSoftBody& soft = a.soft ? *a.soft : *b.soft;
  const btCollisionObject* obstacle = a.soft ? b.object : a.object;
  const auto in_contact = [&](const btSoftBody::Node* node) {
    return std::any_of(contact.vertices.begin(), contact.vertices.end(), [&](std::int32_t v) {
      return topology_.is_soft(v) && &scene_.node(v) == node;
    });
  };
  for (int i = 0; i < soft.m_anchors.size(); ++i) {
    const btSoftBody::Anchor& anchor = soft.m_anchors[i];
    if (anchor.m_body == obstacle && in_contact(anchor.m_node)) return true;
  }
  for (int i = 0; i < soft.m_deformableAnchors.size(); ++i) {
    const btSoftBody::DeformableNodeRigidAnchor& anchor = soft.m_deformableAnchors[i];
    if (anchor.m_cti.m_colObj == obstacle && in_contact(anchor.m_node)) return true;
  }
  return false;
}

void Pipeline::collect_contacts(double seconds) {
  if (responded_) {
    for (const ContactRow& row : response_.rows()) {
      contacts_.push_back(step_contact(row.contact, row.impulse / seconds));
    }
  }
  for (const Contact& contact : silent_) contacts_.push_back(step_contact(contact, 0));
  for (const StepContact& contact : contacts_) {
    ++(contact.kind == ContactKind::vertex_face ? step_.contacts_vf : step_.contacts_ee);
  }
}

StepContact Pipeline::step_contact(const Contact& contact, double impulse) const {
  StepContact c;
  c.kind = contact.kind;
  c.body_a = topology_.bodies()[contact.body_a].object;
  c.body_b = topology_.bodies()[contact.body_b].object;
  for (int i = 0; i < 4; ++i) {
    const std::int32_t v = contact.vertices[i];
    c.nodes[i] = topology_.is_soft(v) ? &scene_.node(v) : nullptr;
  }
  const bool has_face =
      c.kind == ContactKind::vertex_face && topology_.bodies()[contact.body_b].soft;
  c.face = has_face ? &scene_.face(contact.primitive_b) : nullptr;
  c.weights = contact.weights();
  c.normal = btVector3(contact.normal[0], contact.normal[1], contact.normal[2]);
  c.toi = contact.toi;
  c.impulse = impulse;
  return c;
}

bool Pipeline::is_moved(std::int32_t vertex) const {
  return responded_ && (motion_.solved[vertex] != motion_.predicted[vertex] ||
                        motion_.opening[vertex] != Eigen::Vector3d::Zero());
}

std::string Pipeline::status() const {
  std::string text = "LazyCCD: " + (detector_ ? detector_->status() : "no step yet") + ", " +
                     std::to_string(scene_.bodies().size()) + " soft bodies, " +
                     std::to_string(total_.steps) + " steps, " +
                     std::to_string(total_.last_resorts) + " nodes held as the last resort\n";
  return text + journal_.text();
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
