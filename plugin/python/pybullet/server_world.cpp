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

  // Wherever the server keeps the listener, it gets its own helper back, also if nothing else is as
  // expected.
  std::memcpy(after.data(), data, count * sizeof(void*));
  std::size_t changed = 0, kept = 0;
  for (std::size_t i = 0; i < count; ++i) {
    if (after[i] == before[i]) continue;
    ++changed;
    if (after[i] != static_cast<GUIHelperInterface*>(&listener)) continue;
    ++kept;
    std::memcpy(static_cast<char*>(data) + i * sizeof(void*), &before[i], sizeof(void*));
  }
  if (changed != 1 || kept != 1 || !listener.was_called) return {};
  return listener.world;
}

}  // namespace lazyccd::pybullet
