#include "netem/lab/rogue_link.hpp"

#include "common/runtime/link_options.hpp"

namespace farhand::rogue {

std::unique_ptr<PeerLink> open_rogue_link(const std::string& key_file, const std::string& address, Role role,
                                          const scene::Scene& scene) {
  LinkOptions options;
  options.key = key_file;
  return open_link(options, address, role, scene);
}

}  // namespace farhand::rogue
