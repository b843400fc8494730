// The link by which a rogue peer reaches real programs. The peer has the pairing key and therefore is authentic.
#pragma once

#include <memory>
#include <string>

#include "common/runtime/peer_link.hpp"
#include "proto/scene.pb.h"

namespace farhand::rogue {

// A therapist's station listens at `address`, a patient's box dials it.
std::unique_ptr<PeerLink> open_rogue_link(const std::string& key_file, const std::string& address, Role role,
                                          const scene::Scene& scene);

}  // namespace farhand::rogue
