#include "scenes/meshes/solid.h"

#include <BulletSoftBody/btSoftBodyHelpers.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <set>
#include <utility>
#include <vector>

namespace lazyccd::scenes {
namespace {

std::unique_ptr<btSoftBody> make_body(btSoftBodyWorldInfo& info,
                                      const std::vector<btVector3>& positions, double mass) {
  const auto count = static_cast<int>(positions.size());
  const std::vector<btScalar> masses(positions.size(), static_cast<btScalar>(mass / count));
  auto body = std::make_unique<btSoftBody>(&info, count, positions.data(), masses.data());
  body->appendMaterial();
  return body;
}

// Turns all faces outwards; Bullet leaves the orientation of boundary faces open. Correct for
// bodies that are star-shaped about the mean of their nodes.
void turn_outwards(btSoftBody& body) {
  btVector3 middle(0, 0, 0);
  for (int i = 0; i < body.m_nodes.size(); ++i) middle += body.m_nodes[i].m_x;
  middle /= static_cast<btScalar>(body.m_nodes.size());
  for (int i = 0; i < body.m_faces.size(); ++i) {
    auto& corners = body.m_faces[i].m_n;
    const btVector3 &a = corners[0]->m_x, &b = corners[1]->m_x, &c = corners[2]->m_x;
    if ((b - a).cross(c - a).dot(a - middle) < 0) std::swap(corners[1], corners[2]);
  }
}

}  // namespace

std::unique_ptr<btSoftBody> make_solid(
    btSoftBodyWorldInfo& info, int cells, double mass,
    const std::function<btVector3(double u, double v, double w)>& at) {
  return make_solid(info, {cells, cells, cells}, mass, at);
}

std::unique_ptr<btSoftBody> make_solid(
    btSoftBodyWorldInfo& info, const std::array<int, 3>& cells, double mass,
    const std::function<btVector3(double u, double v, double w)>& at) {
  const int columns = cells[0] + 1, rows = cells[1] + 1;
  std::vector<btVector3> positions;
  for (int k = 0; k <= cells[2]; ++k) {
    for (int j = 0; j <= cells[1]; ++j) {
      for (int i = 0; i <= cells[0]; ++i) {
        positions.push_back(at(i / double(cells[0]), j / double(cells[1]), k / double(cells[2])));
      }
    }
  }
  auto body = make_body(info, positions, mass);

  // Kuhn's division of a cube: one tetrahedron for each order of the three axes on a walk from one
  // corner to the opposite corner. The faces of neighbouring cubes match.
  std::set<std::array<int, 2>> sides;
  const std::array<int, 3> strides = {1, columns, columns * rows};
  for (int k = 0; k < cells[2]; ++k) {
    for (int j = 0; j < cells[1]; ++j) {
      for (int i = 0; i < cells[0]; ++i) {
        std::array<int, 3> axes = {0, 1, 2};
        do {
          std::array<int, 4> corners = {i + columns * (j + rows * k), 0, 0, 0};
          for (int step = 0; step < 3; ++step) {
            corners[step + 1] = corners[step] + strides[axes[step]];
          }
          body->appendTetra(corners[0], corners[1], corners[2], corners[3]);
          for (int a = 0; a < 4; ++a) {
            for (int b = a + 1; b < 4; ++b) sides.insert({corners[a], corners[b]});
          }
        } while (std::next_permutation(axes.begin(), axes.end()));
      }
    }
  }
  for (const auto& side : sides) body->appendLink(side[0], side[1]);
  btSoftBodyHelpers::generateBoundaryFaces(body.get());
  turn_outwards(*body);
  // Bullet's deformable world reads these data of bodies with tetrahedra.
  body->initializeDmInverse();
  btSoftBody::TetraScratch scratch;
  scratch.m_F.setIdentity();
  scratch.m_cofF.setIdentity();
  scratch.m_corotation.setIdentity();
  scratch.m_trace = scratch.m_J = 0;
  body->m_tetraScratches.resize(body->m_tetras.size(), scratch);
  body->m_tetraScratchesTn.resize(body->m_tetras.size(), scratch);
  return body;
}

std::unique_ptr<btSoftBody> make_ball(btSoftBodyWorldInfo& info, int cells, double mass,
                                      const btVector3& centre, double radius) {
  return make_solid(info, cells, mass, [&](double u, double v, double w) {
    // Maps each cubical shell to a spherical one.
    const double x = 2 * u - 1, y = 2 * v - 1, z = 2 * w - 1;
    const double shell = std::max({std::abs(x), std::abs(y), std::abs(z)});
    const double length = std::sqrt(x * x + y * y + z * z);
    const double scale = length > 0 ? radius * shell / length : 0;
    return centre + btVector3(static_cast<btScalar>(scale * x), static_cast<btScalar>(scale * y),
                              static_cast<btScalar>(scale * z));
  });
}

std::unique_ptr<btSoftBody> make_rope(btSoftBodyWorldInfo& info, int nodes, double mass,
                                      const btVector3& from, const btVector3& to) {
  std::vector<btVector3> positions;
  for (int i = 0; i < nodes; ++i) {
    positions.push_back(from.lerp(to, static_cast<btScalar>(i / (nodes - 1.0))));
  }
  auto rope = make_body(info, positions, mass);
  for (int i = 1; i < nodes; ++i) rope->appendLink(i - 1, i);
  return rope;
}

std::unique_ptr<btSoftBody> make_wound_rope(btSoftBodyWorldInfo& info, int nodes, double mass,
                                            double radius, double turns, double pitch, double end) {
  const double angle = 2 * 3.14159265358979 * turns, arc = angle * radius, length = arc + 2 * end;
  std::unique_ptr<btSoftBody> rope =
      make_rope(info, nodes, mass, vector(0, 0, 0), vector(length, 0, 0));
  for (int i = 0; i < nodes; ++i) {
    const double along = length * i / (nodes - 1) - end;
    const double a = std::clamp(along / radius, 0.0, angle), beyond = along - a * radius;
    btSoftBody::Node& node = rope->m_nodes[i];
    node.m_x = vector(radius * std::cos(a) - beyond * std::sin(a),
                      radius * std::sin(a) + beyond * std::cos(a), pitch * turns * a / angle);
    node.m_q = node.m_x;
  }
  for (int i = 0; i < rope->m_links.size(); ++i) {
    btSoftBody::Link& link = rope->m_links[i];
    link.m_rl = (link.m_n[0]->m_x - link.m_n[1]->m_x).length();
    link.m_c1 = link.m_rl * link.m_rl;
  }
  return rope;
}

}  // namespace lazyccd::scenes
