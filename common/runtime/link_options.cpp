#include "common/runtime/link_options.hpp"

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <iterator>
#include <stdexcept>

#include "common/config/load.hpp"
#include "common/files/output.hpp"
#include "common/runtime/program.hpp"

namespace farhand {
namespace {

std::filesystem::path key_file(const std::string& chosen) {
  if (!chosen.empty()) return chosen;
  if (auto file = default_key_file(); !file.empty()) return file;
  throw std::runtime_error("neither HOME nor XDG_CONFIG_HOME says where the pairing key is; say --key FILE");
}

void add_key_option(Command command, std::string& key) {
  command.input("--key", key, "file of the pairing key; without it the user's own, ~/.config/farhand/key");
}

struct PairOptions {
  std::string key, import;
  bool rotate = false, revoke = false;
};

PairingKey import_key(const std::string& from) {
  std::string text;
  if (from == "-") {
    text.assign(std::istreambuf_iterator<char>(std::cin), {});
  } else {
    std::ifstream in(from, std::ios::binary);
    if (!in) throw std::runtime_error("cannot read the key " + from + ": " + std::strerror(errno));
    text.assign(std::istreambuf_iterator<char>(in), {});
  }
  try {
    return PairingKey::from_text(text);
  } catch (const std::invalid_argument& error) {
    throw std::runtime_error((from == "-" ? "standard input" : from) + ": " + error.what());
  }
}

int pair(const PairOptions& options) {
  if (static_cast<int>(!options.import.empty()) + options.rotate + options.revoke > 1) {
    throw std::invalid_argument("--import, --rotate and --revoke exclude each other");
  }
  const std::filesystem::path file = key_file(options.key);
  if (options.revoke) {
    revoke_key(file);
    std::printf(
        "revoked: %s is gone. A station that runs keeps its key until its end; revoke it on the other side too.\n",
        file.c_str());
    return kExitOk;
  }
  const bool there = std::filesystem::exists(file);
  if (options.rotate) load_key(file);  // only what is a key is replaced
  if (!options.import.empty()) {
    if (same_on_disk(options.import, file)) throw std::invalid_argument("--import " + options.import + " is that key");
    const PairingKey key = import_key(options.import);
    if (there) load_key(file);
    store_key(file, key, there ? ExistingKey::kReplace : ExistingKey::kRefuse);
  } else if (!there || options.rotate) {
    store_key(file, PairingKey::random(), there ? ExistingKey::kReplace : ExistingKey::kRefuse);
  }
  const PairingKey key = load_key(file);
  const char* what = !options.import.empty() ? "imported"
                     : options.rotate        ? "rotated"
                     : there                 ? "there already"
                                             : "made";
  std::printf("key: %s (%s)\nidentity: %s\ncheck phrase: %s\n", file.c_str(), what, key.identity().c_str(),
              key.check_phrase().c_str());
  std::printf("Both sides must read out the same phrase. Whoever has this file can move the patient's hand.\n");
  return kExitOk;
}

}  // namespace

void add_link_options(Command command, LinkOptions& options) {
  add_key_option(command, options.key);
  command.flag("--insecure", options.insecure, "no pairing key: packets in the clear, on loopback addresses only");
}

std::string shared_configuration(const scene::Scene& scene) {
  scene::Scene shared;
  shared.set_architecture(scene.architecture());
  shared.set_tick_s(scene.tick_s());
  *shared.mutable_control() = scene.control();
  *shared.mutable_engagement() = scene.engagement();
  shared.mutable_engagement()->clear_resume_s();  // each side's own
  *shared.mutable_master()->mutable_axis() = scene.master().axis();
  *shared.mutable_slave()->mutable_axis() = scene.slave().axis();
  shared.mutable_slave()->set_device(scene.slave().device());
  return complete_text(shared);
}

std::unique_ptr<PeerLink> open_link(const LinkOptions& options, const std::string& address, Role role,
                                    const scene::Scene& scene) {
  const bool listens = role == Role::kLeader;
  const UdpEndpoint endpoint = parse_endpoint(address, listens ? EndpointUse::kListen : EndpointUse::kPeer);
  if (options.insecure) {
    if (!options.key.empty()) throw std::invalid_argument("--insecure has no use for --key");
    return make_bare_link(listens ? UdpSocket::listen(endpoint) : UdpSocket::dial(endpoint));
  }
  const PairingKey key = load_key(key_file(options.key));
  Greeting own;
  own.role = role;
  own.configuration = fingerprint(shared_configuration(scene));
  own.program = FARHAND_VERSION;
  UdpSocket socket =
      listens ? UdpSocket::listen(endpoint, Reach::kAnywhere) : UdpSocket::dial(endpoint, Reach::kAnywhere);
  return make_secured_link(std::move(socket), key, own, listens ? "farhand-master" : "farhand-slave");
}

int run_pair(const std::string& program, int argc, char** argv) {
  PairOptions options;
  Program pairing(program + " pair",
                  "The key that a therapist's station and a patient's box share: makes it if there is none, and shows "
                  "its check phrase.");
  Command command = pairing.command();
  add_key_option(command, options.key);
  command.input("--import", options.import, "take the key that the other side has made from this file; - is stdin");
  command.flag("--rotate", options.rotate, "a new key in place of the old one");
  command.flag("--revoke", options.revoke, "overwrite and remove the key");
  return pairing.run(argc, argv, [&] { return pair(options); });
}

}  // namespace farhand
