// Exact decision by the host's threads of the queries that need integers of any size.
#include "gpu/narrow/undecided.h"

#include <algorithm>
#include <cstring>
#include <vector>

#include "cpu/narrow/exact.h"

namespace lazyccd::gpu {

std::size_t merge_undecided(const Mesh& mesh, const Positions& start, const Positions& end,
                            const HardQuery* queries, std::size_t query_count, ThreadPool& pool,
                            Contact* contacts, std::size_t count, Stats& stats) {
  if (query_count == 0) return count;
  std::vector<std::vector<Contact>> parts(static_cast<std::size_t>(pool.size()));
  pool.parallel_for(query_count, 4, [&](std::size_t first, std::size_t last, int worker) {
    for (std::size_t i = first; i < last; ++i) {
      Contact contact;
      if (decide_exactly(static_cast<ContactKind>(queries[i].kind), mesh.view(), queries[i].pair,
                         start, end, contact))
        parts[worker].push_back(contact);
    }
  });
  std::vector<Contact> found;
  for (const std::vector<Contact>& part : parts)
    found.insert(found.end(), part.begin(), part.end());
  for (const Contact& contact : found) {
    stats.hash += hash_share(contact);
    ++(contact.kind == ContactKind::vertex_face ? stats.contacts_vf : stats.contacts_ee);
  }
  const ContactOrder order = mesh.contact_order();
  std::sort(found.begin(), found.end(), order);
  // From the back, so that each contact moves only once, directly to its place.
  std::size_t from = count, to = count + found.size();
  for (std::size_t i = found.size(); i-- > 0;) {
    const Contact* place = std::lower_bound(contacts, contacts + from, found[i], order);
    const std::size_t behind = static_cast<std::size_t>(contacts + from - place);
    std::memmove(contacts + (to - behind), place, behind * sizeof(Contact));
    from -= behind;
    to -= behind + 1;
    contacts[to] = found[i];
  }
  return count + found.size();
}

}  // namespace lazyccd::gpu
