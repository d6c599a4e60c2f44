// Finds the world of a physics server.
#pragma once

#include <optional>

class PhysicsCommandProcessorInterface;
class btDiscreteDynamicsWorld;

namespace lazyccd::pybullet {

/// Returns the server's world, null between the end of one world and the start of the next. Empty
/// if the server is not laid out as PyBullet 3.2.7's. Call it on the server's thread.
///
/// The server tells a new helper for its user interface the world, and keeps the helper. Here it
/// gets one that only notes the world; then the old helper, which may be that of a window, is put
/// back into the server's data. Its place is found by what the call changed.
std::optional<btDiscreteDynamicsWorld*> find_world(PhysicsCommandProcessorInterface& server);

}  // namespace lazyccd::pybullet
