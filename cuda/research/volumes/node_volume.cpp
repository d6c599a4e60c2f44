#include "research/volumes/node_volume.h"

#include "research/volumes/dop18.h"
#include "research/volumes/oriented_boxes.h"

namespace lazyccd::research {

std::unique_ptr<NodeVolume> make_node_volume(Volume volume, double margin) {
  switch (volume) {
    case Volume::box:
      return nullptr;
    case Volume::dop18:
      return std::make_unique<DiagonalSlabs>(margin);
    case Volume::oriented_box:
      return std::make_unique<OrientedBoxes>(margin);
  }
  return nullptr;
}

}  // namespace lazyccd::research
