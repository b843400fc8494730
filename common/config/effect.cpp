#include "common/config/effect.hpp"

#include <google/protobuf/text_format.h>

#include <memory>
#include <set>
#include <span>

#include "common/config/scene_kind.hpp"
#include "common/config/schema.hpp"
#include "common/law/architectures.hpp"

namespace farhand {
namespace {

using google::protobuf::FieldDescriptor;
using google::protobuf::Message;
using google::protobuf::Reflection;
using google::protobuf::TextFormat;

using scene::Scene;

// path: a field, or a group with all that is in it.
struct Effect {
  const char* path;
  const char* needs;
  bool (*there)(const Scene&);
};

bool is_direct(const Scene& s) { return !is_elastic(s); }
bool never(const Scene&) { return false; }
bool is_adaptive(const Scene& s) { return s.world().method() == scene::ADAPTIVE; }
bool has_own_grip(const Scene& s) { return s.master().therapist().grip() == scene::CUSTOM; }
template <bool kForward>
const scene::Path& path_of(const Scene& s) {
  return kForward ? s.network().forward() : s.network().backward();
}
template <bool kForward>
bool varies(const Scene& s) {
  return path_of<kForward>(s).distribution() != scene::CONSTANT;
}
template <bool kForward>
bool has_detour(const Scene& s) {
  return path_of<kForward>(s).has_detour_delay_s();
}

constexpr const char *kDirect = "slave.device DIRECT_DRIVE", *kElastic = "slave.device SERIES_ELASTIC";
constexpr const char* kPatients = "the patient's axis, slave.axis";
constexpr const char *kCustom = "master.therapist.grip CUSTOM", *kAdaptive = "world.method ADAPTIVE";
constexpr const char* kVaries = "distribution UNIFORM or NORMAL_DISTRIBUTION";

constexpr Effect kRefused[] = {
    {"slave.power_stage", kDirect, is_direct},
    {"master.axis.acceleration_limit_rad_s2", kPatients, never},
    {"master.therapist.K_h_nm_per_rad", kCustom, has_own_grip},
    {"master.therapist.B_h_nms_per_rad", kCustom, has_own_grip},
    {"slave.axis.gravity_nm", kDirect, is_direct},
};

constexpr Effect kIdle[] = {
    {"slave.motor", kDirect, is_direct},
    {"slave.series_elastic", kElastic, is_elastic},
    {"slave.mcu", kElastic, is_elastic},
    {"slave.hand.spastic_above_rad_s", "slave.hand.spastic_nms_per_rad",
     [](const Scene& s) { return s.slave().hand().spastic_nms_per_rad() > 0; }},
    {"slave.hand.rest_frequency_hz", "slave.hand.rest_amplitude_rad",
     [](const Scene& s) { return s.slave().hand().rest_amplitude_rad() > 0; }},
    {"slave.hand.relax_time_s", "slave.hand.relaxed_nm_per_rad",
     [](const Scene& s) { return s.slave().hand().has_relaxed_nm_per_rad(); }},
    {"slave.hand.tremor_hz", "slave.hand.tremor_nm", [](const Scene& s) { return s.slave().hand().tremor_nm() > 0; }},
    {"network.forward.jitter_s", kVaries, varies<true>},
    {"network.backward.jitter_s", kVaries, varies<false>},
    {"network.forward.detour_from_s", "network.forward.detour_delay_s", has_detour<true>},
    {"network.forward.detour_until_s", "network.forward.detour_delay_s", has_detour<true>},
    {"network.forward.detour_ramp_s", "network.forward.detour_delay_s", has_detour<true>},
    {"network.backward.detour_from_s", "network.backward.detour_delay_s", has_detour<false>},
    {"network.backward.detour_until_s", "network.backward.detour_delay_s", has_detour<false>},
    {"network.backward.detour_ramp_s", "network.backward.detour_delay_s", has_detour<false>},
    {"world.rtol", kAdaptive, is_adaptive},
    {"world.atol", kAdaptive, is_adaptive},
    {"slave.series_elastic.tendon_stiffness_nm_per_rad", "slave.series_elastic.tendon_friction_nm",
     [](const Scene& s) { return is_direct(s) || s.slave().series_elastic().tendon_friction_nm() > 0; }},
    {"master.axis.gravity_angle_rad", "master.axis.gravity_nm",
     [](const Scene& s) { return s.master().axis().gravity_nm() > 0; }},
    {"master.motor.gravity_angle_rad", "master.motor.gravity_nm",
     [](const Scene& s) { return s.master().motor().gravity_nm() > 0; }},
    {"slave.axis.gravity_angle_rad", "slave.axis.gravity_nm",
     [](const Scene& s) { return s.slave().axis().gravity_nm() > 0; }},
    {"slave.motor.gravity_angle_rad", "slave.motor.gravity_nm",
     [](const Scene& s) { return is_elastic(s) || s.slave().motor().gravity_nm() > 0; }},
};

constexpr const char* kVirtual = "virtual time: leave it out where the programs run, or use farhand-lab run";
constexpr Effect kVirtualTime[] = {
    {"master.host", kVirtual, never},
    {"slave.host", kVirtual, never},
    {"network.peer_clock_offset_s", kVirtual, never},
    {"network.peer_clock_skew_ppm", kVirtual, never},
    {"slave.series_elastic.serial_one_way_s", kVirtual, never},
};

constexpr const char* kNoMcu = "a master that is not behind a serial line";
constexpr Effect kDirectMaster[] = {
    {"master.power_stage", kNoMcu, never},
    {"master.axis.gravity_nm", kNoMcu, never},
};

// Calls found(path, "path = value") for what is not at its default.
template <class Found>
void given(const Message& message, const FieldDescriptor& field, const std::string& path, const Found& found) {
  const Reflection& reflection = *message.GetReflection();
  if (!reflection.HasField(message, &field)) return;
  if (field.message_type() == nullptr) {
    const std::unique_ptr<Message> usual(message.New());
    const scene::FieldInfo& info = field_info(field);
    if (info.has_default_text() && !may_stay_absent(field))
      TextFormat::ParseFieldValueFromString(info.default_text(), &field, usual.get());
    if (!reflection.HasField(*usual, &field) || value_text(*usual, field) != value_text(message, field))
      found(path, path + " = " + value_text(message, field));
    return;
  }
  if (may_stay_absent(field)) return found(path, path);
  const Message& group = reflection.GetMessage(message, &field);
  for (int i = 0; i < group.GetDescriptor()->field_count(); ++i) {
    const FieldDescriptor& inner = *group.GetDescriptor()->field(i);
    if (!inner.is_repeated()) given(group, inner, path + "." + inner.name(), found);
  }
}

// The same for a field, or a group, of the scene.
template <class Found>
void given(const Scene& scene, const std::string& path, const Found& found) {
  const Message* message = &scene;
  for (std::size_t begin = 0;;) {
    const std::size_t end = path.find('.', begin);
    const FieldDescriptor& field = *message->GetDescriptor()->FindFieldByName(path.substr(begin, end - begin));
    if (end == std::string::npos) return given(*message, field, path, found);
    if (!message->GetReflection()->HasField(*message, &field)) return;
    message = &message->GetReflection()->GetMessage(*message, &field);
    begin = end + 1;
  }
}

std::vector<Complaint> without_effect(const Scene& scene, std::span<const Effect> table) {
  std::vector<Complaint> all;
  for (const Effect& row : table) {
    if (row.there(scene)) continue;
    given(scene, row.path, [&](const std::string& path, const std::string& value) {
      all.push_back({path, value + " has no effect: it needs " + row.needs});
    });
  }
  return all;
}

// What the laws of other architectures read.
void of_other_laws(const Scene& scene, std::vector<Complaint>& all) {
  const Architecture& laws = architecture(scene::Architecture_Name(scene.architecture()));
  std::set<std::string_view> seen;
  for (const Architecture& other : architectures()) {
    for (const LawMaker& side : {other.master, other.slave}) {
      for (const LawBlock& block : side.blocks) {
        for (const std::string_view setting : block.settings) {
          if (setting.empty() || reads(laws, setting) || !seen.insert(setting).second) continue;
          std::string needs;
          for (const Architecture& one : architectures())
            if (reads(one, setting)) needs += (needs.empty() ? "architecture " : " or ") + std::string(one.name);
          given(scene, std::string(setting), [&](const std::string& path, const std::string& value) {
            all.push_back({path, value + " has no effect: it needs " + needs});
          });
        }
      }
    }
  }
}

}  // namespace

std::vector<Complaint> refused_settings(const Scene& scene) { return without_effect(scene, kRefused); }

std::vector<Complaint> idle_settings(const Scene& scene) {
  std::vector<Complaint> all = without_effect(scene, kIdle);
  of_other_laws(scene, all);
  for (int i = 0; i < scene.master().therapist().intended_size(); ++i) {
    const scene::Movement& movement = scene.master().therapist().intended(i);
    const std::string path = "master.therapist.intended[" + std::to_string(i) + "].sine_frequency_hz";
    if (movement.has_sine_amplitude_rad()) continue;
    given(movement, *movement.GetDescriptor()->FindFieldByName("sine_frequency_hz"), path,
          [&](const std::string&, const std::string& value) {
            all.push_back({path, value + " has no effect: it needs sine_amplitude_rad"});
          });
  }
  return all;
}

void refuse_virtual_time(const Scene& scene) { refuse(without_effect(scene, kVirtualTime)); }
void refuse_direct_drive_of_master(const Scene& scene) { refuse(without_effect(scene, kDirectMaster)); }

}  // namespace farhand
