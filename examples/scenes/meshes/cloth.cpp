#include "scenes/meshes/cloth.h"

#include <cmath>
#include <vector>

namespace lazyccd::scenes {
namespace {

// Returns a number in [-1, 1) that is the same on every platform, unlike std distributions.
double symmetric(std::mt19937& random) { return random() / 2147483648.0 - 1; }

}  // namespace

std::unique_ptr<btSoftBody> make_cloth(btSoftBodyWorldInfo& info, int columns, int rows,
                                       double mass,
                                       const std::function<btVector3(double u, double v)>& at) {
  std::vector<btVector3> positions;
  for (int row = 0; row < rows; ++row) {
    for (int column = 0; column < columns; ++column) {
      positions.push_back(at(column / (columns - 1.0), row / (rows - 1.0)));
    }
  }
  const int count = columns * rows;
  const std::vector<btScalar> masses(positions.size(), static_cast<btScalar>(mass / count));
  auto cloth = std::make_unique<btSoftBody>(&info, count, positions.data(), masses.data());
  cloth->appendMaterial();
  const auto node = [columns](int column, int row) { return row * columns + column; };
  for (int row = 0; row < rows; ++row) {
    for (int column = 0; column < columns; ++column) {
      const int n00 = node(column, row), n10 = n00 + 1, n01 = n00 + columns, n11 = n01 + 1;
      if (column + 1 < columns) cloth->appendLink(n00, n10);
      if (row + 1 < rows) cloth->appendLink(n00, n01);
      if (column + 1 == columns || row + 1 == rows) continue;
      if ((column + row) % 2) {
        cloth->appendFace(n00, n01, n11);
        cloth->appendFace(n00, n11, n10);
        cloth->appendLink(n00, n11);
      } else {
        cloth->appendFace(n00, n01, n10);
        cloth->appendFace(n10, n01, n11);
        cloth->appendLink(n01, n10);
      }
    }
  }
  return cloth;
}

std::unique_ptr<btSoftBody> make_sheet(btSoftBodyWorldInfo& info, const Sheet& sheet,
                                       std::mt19937& random) {
  const double c = std::cos(sheet.angle), s = std::sin(sheet.angle);
  return make_cloth(info, sheet.columns, sheet.rows, sheet.mass, [&](double u, double v) {
    const double x = (u - 0.5) * sheet.width, z = (v - 0.5) * sheet.length;
    const double dx = sheet.jitter * symmetric(random), dy = sheet.jitter * symmetric(random),
                 dz = sheet.jitter * symmetric(random);
    return btVector3(static_cast<btScalar>(c * x + s * z + dx),
                     static_cast<btScalar>(sheet.height + dy),
                     static_cast<btScalar>(c * z - s * x + dz));
  });
}

void pin_border(btSoftBody& cloth, int columns, int rows) {
  for (int row = 0; row < rows; ++row) {
    for (int column = 0; column < columns; ++column) {
      if (row == 0 || column == 0 || row + 1 == rows || column + 1 == columns) {
        cloth.setMass(row * columns + column, 0);
      }
    }
  }
}

void pin(btSoftBody& body, int first_node, int last_node) {
  for (int i = first_node; i <= last_node; ++i) body.setMass(i, 0);
}

void steer(btSoftBody::Node& node, const btVector3& goal, double dt) {
  node.m_v = (goal - node.m_x) / static_cast<btScalar>(dt);
}

}  // namespace lazyccd::scenes
