#include "server_world.h"

#include <BulletDynamics/Dynamics/btDiscreteDynamicsWorld.h>
#include <CommonInterfaces/CommonGUIHelperInterface.h>
#include <SharedMemory/PhysicsCommandProcessorInterface.h>
#include <malloc.h>

#include <cstddef>
#include <cstring>
#include <vector>

namespace lazyccd::pybullet {
namespace {

struct WorldListener : DummyGUIHelper {
  btDiscreteDynamicsWorld* world = nullptr;
  bool was_called = false;
  void createPhysicsDebugDrawer(btDiscreteDynamicsWorld* told) override {
    world = told;
    was_called = true;
  }
};

}  // namespace

std::optional<btDiscreteDynamicsWorld*> find_world(PhysicsCommandProcessorInterface& server) {
  // The server is a table of virtual functions and a pointer to its data.
  void* data = nullptr;
  std::memcpy(&data, reinterpret_cast<const char*>(&server) + sizeof(void*), sizeof data);
  const std::size_t count = malloc_usable_size(data) / sizeof(void*);
  if (count == 0) return {};
  std::vector<void*> before(count), after(count);
  std::memcpy(before.data(), data, count * sizeof(void*));

  // Static, so that a server that kept it would not hold a dangling pointer.
  static thread_local WorldListener listener;
  listener.world = nullptr;
  listener.was_called = false;
  server.setGuiHelper(&listener);

  std::memcpy(after.data(), data, count * sizeof(void*));
  std::size_t changed = 0, place = 0;
  for (std::size_t i = 0; i < count; ++i) {
    if (after[i] == before[i]) continue;
    ++changed;
    place = i;
  }
  if (changed != 1 || after[place] != static_cast<GUIHelperInterface*>(&listener)) return {};
  std::memcpy(static_cast<char*>(data) + place * sizeof(void*), &before[place], sizeof(void*));
  if (!listener.was_called) return {};
  return listener.world;
}

}  // namespace lazyccd::pybullet
