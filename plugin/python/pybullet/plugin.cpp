// The plugin that PyBullet's loadPlugin() loads into a physics server. Every soft and deformable
// world of the server gets LazyCCD's solver. lazyccd/pybullet.py sends the commands below and reads
// the replies.
//
//   on, off              in this world and in later ones
//   set NAME VALUE ...   options, all or none; the world's solver starts anew
//   options, status, excluded, stats, total_stats, contacts
//
// All functions run on the server's thread, apart from lazyccd_pybullet_reply().
#include <SharedMemory/PhysicsCommandProcessorInterface.h>
#include <SharedMemory/SharedMemoryPublic.h>
#include <SharedMemory/plugins/b3PluginAPI.h>
#include <SharedMemory/plugins/b3PluginContext.h>
#include <dlfcn.h>

#include <cstdint>
#include <cstdio>
#include <exception>
#include <map>
#include <memory>
#include <mutex>
#include <sstream>
#include <stdexcept>
#include <string>
#include <utility>

#include "attachment.h"
#include "records.h"
#include "server_world.h"
#include "text/option_table.h"
#include "text/stats_text.h"

namespace lazyccd::pybullet {
namespace {

// How a status begins if LazyCCD can do nothing; load() of lazyccd/pybullet.py looks for it.
constexpr char kRefused[] = "refused: ";

class Plugin {
 public:
  Plugin(PhysicsCommandProcessorInterface& server, int number) : number_(number), server_(&server) {
    options_.on_message = [](const std::string& line) {
      std::fprintf(stderr, "lazyccd: %s\n", line.c_str());
    };
    attach_new_world();
  }

  /// To be called at the end of the server, whose world is gone, or by unloadPlugin(), when it
  /// lives.
  void detach() {
    if (attachment_ && current_world() == &attachment_->world()) attachment_->detach();
  }

  /// Contacts name bodies, so those of the last step are not reported once a body is gone.
  void body_removed() { removed_after_ = total_stats().steps; }

  void attach_new_world() {
    attachment_.reset();
    removed_after_ = -1;
    const auto world = find_world(*server_);
    if (!world) {
      note_ = std::string(kRefused) +
              "this PyBullet is not laid out as version 3.2.7: the server's data";
      return;
    }
    note_ = "there is no world";
    if (!*world) return;
    if (is_on_)
      attachment_ = std::make_unique<Attachment>(**world, options_);
    else
      note_ = "off";
  }

  /// Carries out a command and returns its reply. Throws std::invalid_argument.
  std::string execute(const std::string& command) {
    std::istringstream words(command);
    std::string verb;
    words >> verb;
    if (verb == "on" || verb == "off") {
      switch_on(verb == "on");
      return status();
    }
    if (verb == "set") {
      bullet::SolverOptions wanted = options_;
      std::string name, value;
      while (words >> name) {
        if (!(words >> value)) throw std::invalid_argument(name + ": there is no value");
        text::set_option(wanted, name, value);
      }
      options_ = std::move(wanted);
      if (attachment_ && attachment_->is_attached()) restart();
      return text::options_text(options_);
    }
    if (verb == "options") return text::options_text(options_);
    if (verb == "status") return status();
    if (verb == "excluded")
      return attachment_ ? excluded_records(attachment_->excluded_bodies()) : std::string();
    if (verb == "stats") return text::stats_text(attachment_ ? attachment_->step_stats() : Stats());
    if (verb == "total_stats") return text::stats_text(total_stats());
    if (verb == "contacts") {
      const bool is_known = attachment_ && total_stats().steps != removed_after_;
      return is_known ? contact_records(attachment_->contacts()) : std::string();
    }
    throw std::invalid_argument("there is no command '" + verb + "'");
  }

  int number() const { return number_; }
  std::string reply;  ///< of the last command

 private:
  using Stats = bullet::StepStats;

  Stats total_stats() const { return attachment_ ? attachment_->total_stats() : Stats(); }

  btDiscreteDynamicsWorld* current_world() { return find_world(*server_).value_or(nullptr); }

  void switch_on(bool on) {
    if (on == is_on_) return;
    is_on_ = on;
    if (!on && attachment_) attachment_->detach();
    attach_new_world();
  }

  void restart() {
    attachment_->restart(options_);
    removed_after_ = -1;
  }

  std::string status() const {
    if (!attachment_) return note_;
    return attachment_->layout_is_known() ? attachment_->status() : kRefused + attachment_->note();
  }

  int number_;
  PhysicsCommandProcessorInterface* server_;
  bullet::SolverOptions options_;
  bool is_on_ = true;
  std::unique_ptr<Attachment> attachment_;
  std::int64_t removed_after_ = -1;  // the number of steps when a body was removed last
  std::string note_;
};

// Runs a part of the plugin. No exception may pass through PyBullet's code.
template <class Run>
bool run_safely(const Run& run) noexcept {
  try {
    run();
    return true;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "lazyccd: %s\n", error.what());
  } catch (...) {
    std::fprintf(stderr, "lazyccd: an exception that is not a std::exception\n");
  }
  return false;
}

// All plugins of this process by their number. Never destroyed: servers may end after main().
struct Registry {
  std::mutex mutex;
  std::map<int, Plugin*> plugins;
  int last = 0;
};
Registry& registry() {
  static Registry* const all = new Registry;
  return *all;
}

// Bullet's objects in the server may have been made here, so the code must never go.
void stay_loaded() {
  Dl_info self;
  if (dladdr(reinterpret_cast<void*>(&stay_loaded), &self) != 0)
    dlopen(self.dli_fname, RTLD_NOW | RTLD_NODELETE);
}

}  // namespace
}  // namespace lazyccd::pybullet

using lazyccd::pybullet::Plugin;
using lazyccd::pybullet::registry;

extern "C" {

B3_SHARED_API int initPlugin_lazyccd(b3PluginContext* context) {
  lazyccd::pybullet::stay_loaded();
  context->m_userPointer = nullptr;
  if (!context->m_rpcCommandProcessorInterface) return -1;
  auto& all = registry();
  const std::lock_guard<std::mutex> lock(all.mutex);
  const bool made = lazyccd::pybullet::run_safely([&] {
    auto plugin = std::make_unique<Plugin>(*context->m_rpcCommandProcessorInterface, all.last + 1);
    all.plugins[++all.last] = plugin.get();
    context->m_userPointer = plugin.release();
  });
  return made ? SHARED_MEMORY_MAGIC_NUMBER : -1;
}

B3_SHARED_API int processNotifications_lazyccd(b3PluginContext* context) {
  auto* const plugin = static_cast<Plugin*>(context->m_userPointer);
  if (!plugin) return 0;
  lazyccd::pybullet::run_safely([&] {
    bool is_reset = false;
    for (int i = 0; i < context->m_numNotifications; ++i) {
      const int type = context->m_notifications[i].m_notificationType;
      if (type == BODY_REMOVED) plugin->body_removed();
      is_reset = is_reset || type == SIMULATION_RESET;
    }
    if (is_reset) plugin->attach_new_world();
  });
  return 0;
}

/// Returns the number of the plugin; negative if the reply says what was wrong.
B3_SHARED_API int executePluginCommand_lazyccd(b3PluginContext* context,
                                               const b3PluginArguments* arguments) {
  auto* const plugin = static_cast<Plugin*>(context->m_userPointer);
  if (!plugin) return 0;
  try {
    plugin->reply = plugin->execute(arguments->m_text);
    return plugin->number();
  } catch (const std::exception& error) {
    plugin->reply = error.what();
    return -plugin->number() - 1;
  }
}

B3_SHARED_API void exitPlugin_lazyccd(b3PluginContext* context) {
  auto* const plugin = static_cast<Plugin*>(context->m_userPointer);
  context->m_userPointer = nullptr;
  if (!plugin) return;
  auto& all = registry();
  const std::lock_guard<std::mutex> lock(all.mutex);
  all.plugins.erase(plugin->number());
  lazyccd::pybullet::run_safely([&] { plugin->detach(); });
  delete plugin;
}

/// Sets `data` to the reply of the plugin's last command, valid until its next one, and returns its
/// length; -1 if there is no such plugin in this process.
B3_SHARED_API long long lazyccd_pybullet_reply(int number, const char** data) {
  auto& all = registry();
  const std::lock_guard<std::mutex> lock(all.mutex);
  const auto found = all.plugins.find(number);
  if (found == all.plugins.end()) return -1;
  *data = found->second->reply.data();
  return static_cast<long long>(found->second->reply.size());
}
}
