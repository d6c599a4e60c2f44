#include "cli/stats_json.h"

#include <cinttypes>
#include <cstdio>

#include "io/file.h"

namespace lazyccd::program {

std::string hash_text(std::uint64_t hash) {
  char digits[17];
  std::snprintf(digits, sizeof(digits), "%016" PRIx64, hash);
  return digits;
}

nlohmann::ordered_json to_json(const Stats& stats) {
  return {
      {"backend", stats.backend},
      {"device", stats.device},
      {"threads", stats.threads},
      {"scene",
       {{"vertices", stats.vertices},
        {"edges", stats.edges},
        {"faces", stats.faces},
        {"bodies", stats.bodies},
        {"groups", stats.groups}}},
      {"work",
       {{"tree_tests", stats.tree_tests},
        {"front_start", stats.front_start},
        {"front_nodes", stats.front_nodes},
        {"culled_by_volume", stats.culled_by_volume},
        {"group_pairs", stats.group_pairs},
        {"culled_by_normal_cone", stats.culled_by_normal_cone},
        {"candidates_vf", stats.candidates_vf},
        {"candidates_ee", stats.candidates_ee},
        {"listed_candidates", stats.listed_candidates},
        {"orphan_tests", stats.orphan_tests},
        {"filtered_noncoplanar", stats.filtered_noncoplanar},
        {"survivors_vf", stats.survivors_vf},
        {"survivors_ee", stats.survivors_ee},
        {"double_precision_tests", stats.double_precision_tests},
        {"exact_tests", stats.exact_tests},
        {"steals", stats.steals},
        {"balancings", stats.balancings},
        {"overflows", stats.overflows},
        {"rebuilt", stats.rebuilt},
        {"front_reused", stats.front_reused}}},
      {"contacts", {{"vf", stats.contacts_vf}, {"ee", stats.contacts_ee}}},
      {"hash", hash_text(stats.hash)},
      {"milliseconds",
       {{"upload", stats.ms_upload},
        {"refit", stats.ms_refit},
        {"traverse", stats.ms_traverse},
        {"balance", stats.ms_balance},
        {"leaf", stats.ms_leaf},
        {"narrow", stats.ms_narrow},
        {"front", stats.ms_front},
        {"sort", stats.ms_sort},
        {"download", stats.ms_download},
        {"device", stats.ms_device},
        {"total", stats.ms_total}}},
      {"idle_share", stats.idle_share},
      {"peak_bytes", stats.peak_bytes},
  };
}

void write_json(const std::filesystem::path& path, const nlohmann::ordered_json& json) {
  io::write_file(path, json.dump(2) + "\n");
}

}  // namespace lazyccd::program
