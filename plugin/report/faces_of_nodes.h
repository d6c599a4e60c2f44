// The faces of a soft body by their nodes.
#pragma once

#include <BulletSoftBody/btSoftBody.h>

#include <cstddef>

#include "lazyccd/bullet/precision.h"
#include "util/scratch_vector.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

/// Valid until the faces or nodes of the body change.
class FacesOfNodes {
 public:
  explicit FacesOfNodes(btSoftBody& body);

  /// Returns a face with the first node and, unless it is null, the second. Null if there is none.
  btSoftBody::Face* find(const btSoftBody::Node* first, const btSoftBody::Node* second) const;

 private:
  std::size_t index_of(const btSoftBody::Node* node) const {
    return static_cast<std::size_t>(node - &body_.m_nodes[0]);
  }

  btSoftBody& body_;
  // faces_[first_[n]] up to faces_[first_[n + 1]]: the faces of node n.
  ScratchVector<std::size_t> first_;
  ScratchVector<int> faces_;
};

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
