// How a station's user chooses its link: secured by the pairing key, or bare between programs of one machine.
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

// What both sides must have alike, because each counts on the other's: architecture, gains, period, how they are
// joined, and what the controller believes of both axes. Not the simulated world, the network, the machine.
std::string shared_configuration(const scene::Scene& scene);

// `farhand-master pair`, `farhand-slave pair`: makes, brings over, shows, changes and revokes the key. argv as main's.
int run_pair(const std::string& program, int argc, char** argv);

}  // namespace farhand
