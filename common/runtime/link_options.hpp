// The user's choice of a link: secured by the pairing key, or bare between programs of one machine.
#pragma once

#include <memory>
#include <string>

#include "common/link/greeting.hpp"
#include "common/runtime/command.hpp"
#include "common/runtime/peer_link.hpp"
#include "proto/scene.pb.h"

namespace farhand {

struct LinkOptions {
  std::string key;  // file; empty: the user's own
  bool insecure = false;
};

void add_link_options(Command command, LinkOptions& options);  // --key, --insecure

// The therapist's station listens at `address`, the patient's box dials it. Throws with a sentence.
std::unique_ptr<PeerLink> open_link(const LinkOptions& options, const std::string& address, Role role,
                                    const scene::Scene& scene);

// The settings that must be equal on both sides, because each side relies on the other's: architecture, gains, period,
// the connection of the sides, and the controller's model of both axes. Simulated world, network and machine may
// differ.
std::string shared_configuration(const scene::Scene& scene);

// `farhand-master pair`, `farhand-slave pair`: makes, imports, shows, changes and revokes the key. argv as main's.
int run_pair(const std::string& program, int argc, char** argv);

}  // namespace farhand
