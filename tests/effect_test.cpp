// Settings that a scene gives and that cannot take effect: they are said, they have none, and what has an effect is not
// said.
#include "common/config/effect.hpp"

#include <google/protobuf/descriptor.h>
#include <google/protobuf/text_format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <set>

#include "common/advice/warnings.hpp"
#include "common/config/load.hpp"
#include "common/config/schema.hpp"
#include "netem/lab/simulation.hpp"
#include "tests/support/complaint.hpp"

namespace farhand {
namespace {

using google::protobuf::FieldDescriptor;
using google::protobuf::Message;
using Sets = std::vector<std::string>;

// Engaged at 0.9 s, then moved into contact.
const std::string kSession = R"(architecture: FOUR_CHANNEL
duration_s: 2.5
control { K_f_per_kgm2: 125 }
master { therapist { grip: FIRM intended { duration_s: 0.8 } intended { duration_s: 0.5 ramp_to_rad: 0.2 }
                     intended { duration_s: 5 } } }
slave { hand { stiffness_nm_per_rad: 5 } }
network { forward { delay_s: 0.02 distribution: CONSTANT loss: 0.01 } backward { delay_s: 0.02 distribution: CONSTANT } }
operator_acts { at_s: 0.1 act: ENGAGE }
)";

// Another value than the one there, which is a default or none.
std::string another(const Message& message, const FieldDescriptor& field) {
  const scene::FieldInfo& info = field_info(field);
  switch (field.cpp_type()) {
    case FieldDescriptor::CPPTYPE_DOUBLE: {
      const double now = message.GetReflection()->GetDouble(message, &field);
      for (const double value : {1.25 * now, 0.75 * now, now + 0.1, now + 1.0})
        if (value != now && value > info.min() && value <= info.max() &&
            (!info.integer() || value == std::floor(value)))
          return shortest(value);
      return "";
    }
    case FieldDescriptor::CPPTYPE_ENUM: {
      const int now = message.GetReflection()->GetEnumValue(message, &field);
      return field.enum_type()->FindValueByNumber(now == 1 ? 2 : 1)->name();
    }
    case FieldDescriptor::CPPTYPE_BOOL:
      return message.GetReflection()->GetBool(message, &field) ? "false" : "true";
    default:
      return "";
  }
}

// "field.path=value" for every field of the scene by itself, away from its default. An absent group is given whole, as
// its own defaults make it.
void moved(const Message& message, const std::string& prefix, Sets& sets) {
  for (int i = 0; i < message.GetDescriptor()->field_count(); ++i) {
    const FieldDescriptor& field = *message.GetDescriptor()->field(i);
    if (field.is_repeated()) continue;
    const std::string path = prefix + field.name();
    if (field.message_type() == nullptr) {
      if (const std::string value = another(message, field); !value.empty()) sets.push_back(path + "=" + value);
    } else if (may_stay_absent(field) && !message.GetReflection()->HasField(message, &field)) {
      sets.push_back(path + (field.name() == "host" ? "={stall_s: 0.008}" : "={}"));
    } else {
      moved(message.GetReflection()->GetMessage(message, &field), path + ".", sets);
    }
  }
}

scene::Scene completed(const Sets& sets) { return load_scene_text(kSession, "effect.txtpb", sets).scene; }

// What the set gives, past the loader, which refuses it. Absent: nothing given.
Session run(const std::string& set, const Sets& sets) {
  LoadedScene loaded = load_scene_text(kSession, "effect.txtpb", sets);
  if (!set.empty()) {
    const std::size_t equals = set.find('=');
    Message* message = &loaded.scene;
    for (std::size_t begin = 0;;) {
      const std::size_t end = std::min(set.find('.', begin), equals);
      const FieldDescriptor& field = *message->GetDescriptor()->FindFieldByName(set.substr(begin, end - begin));
      if (end == equals) {
        message->GetReflection()->ClearField(message, &field);
        EXPECT_TRUE(google::protobuf::TextFormat::ParseFieldValueFromString(set.substr(equals + 1), &field, message));
        break;
      }
      message = message->GetReflection()->MutableMessage(message, &field);
      begin = end + 1;
    }
  }
  return simulate(loaded);
}

bool same(const std::vector<StationSample>& a, const std::vector<StationSample>& b) {
  constexpr double StationSample::*kColumns[] = {&StationSample::x_rad,      &StationSample::f_nm,
                                                 &StationSample::command_nm, &StationSample::target_x_rad,
                                                 &StationSample::true_x_rad, &StationSample::true_f_nm};
  return std::ranges::equal(a, b, [&](const StationSample& one, const StationSample& other) {
    return one.state == other.state && std::ranges::all_of(kColumns, [&](const auto column) {
             return std::bit_cast<std::uint64_t>(one.*column) == std::bit_cast<std::uint64_t>(other.*column);
           });
  });
}

// The sentences on one setting: refused by the loader, or said as a warning.
Sets said_of(const std::string& set, Sets sets) {
  sets.push_back(set);
  try {
    Sets all;
    for (const std::string& warning : warnings(load_scene_text(kSession, "effect.txtpb", sets).scene))
      if (warning.find(" has no effect: it needs ") != std::string::npos) all.push_back(warning);
    return all;
  } catch (const ConfigError& error) {
    if (std::string(error.what()).find(" has no effect: it needs ") == std::string::npos) return {};
    return {error.what()};
  }
}

// Both devices, and laws between which every parameter of a law is another's once.
const std::vector<Sets> kSessions{{},
                                  {"slave.device=SERIES_ELASTIC"},
                                  {"architecture=WAVE"},
                                  {"architecture=FOUR_CHANNEL_CDOB_SDCV", "slave.device=SERIES_ELASTIC"}};

TEST(Effect, WhatIsSaidToHaveNoneHasNone) {
  std::set<std::string> fields;
  for (const Sets& sets : kSessions) {
    Sets all;
    moved(completed(sets), "", all);
    ASSERT_GT(all.size(), 150u);
    const Session usual = run("", sets);
    ASSERT_TRUE(std::ranges::any_of(usual.slave, [](const auto& row) { return row.state == 2 && row.f_nm > 0.1; }));
    for (const std::string& set : all) {
      const Sets said = said_of(set, sets);
      if (said.empty()) continue;
      EXPECT_EQ(said.size(), 1u) << set;
      fields.insert(set.substr(0, set.find('=')));
      const Session with = run(set, sets);
      EXPECT_TRUE(same(usual.master, with.master) && same(usual.slave, with.slave)) << set << " has an effect";
    }
  }
  for (const char* field : {"slave.power_stage.hold_s", "slave.motor.J_kgm2", "slave.series_elastic.spring_nm_per_rad",
                            "slave.mcu.g_rad_s", "control.f_1_nm", "control.g_net_rad_s", "control.wave_b_nms_per_rad",
                            "control.tank_level_j", "control.K_2_nm_per_rad", "master.axis.acceleration_limit_rad_s2",
                            "slave.axis.gravity_nm", "network.forward.jitter_s", "world.rtol"}) {
    EXPECT_TRUE(fields.contains(field)) << field << " was never said";
  }
  std::printf("%zu settings are without effect in one of the sessions or more, and said to be\n", fields.size());
}

TEST(Effect, WhatSomebodyWouldRelyOnIsRefused) {
  const auto refused = [&](const Sets& sets) { return complaint(kSession, sets); };
  EXPECT_EQ(refused({"slave.device=SERIES_ELASTIC", "slave.power_stage={hold_s: 0.002 fall_s: 0.004}"}),
            "--set slave.power_stage={hold_s: 0.002 fall_s: 0.004}: slave.power_stage.hold_s = 0.002 has no effect: it "
            "needs slave.device DIRECT_DRIVE\n"
            "--set slave.power_stage={hold_s: 0.002 fall_s: 0.004}: slave.power_stage.fall_s = 0.004 has no effect: it "
            "needs slave.device DIRECT_DRIVE");
  EXPECT_EQ(refused({"slave.power_stage={hold_s: 0.002 fall_s: 0.004}"}), "");
  EXPECT_EQ(refused({"slave.device=SERIES_ELASTIC", "slave.axis.gravity_nm=0.3"}),
            "--set slave.axis.gravity_nm=0.3: slave.axis.gravity_nm = 0.3 has no effect: it needs slave.device "
            "DIRECT_DRIVE");
  EXPECT_EQ(refused({"slave.axis.gravity_nm=0.3"}), "");
  EXPECT_EQ(refused({"master.axis.acceleration_limit_rad_s2=500"}),
            "--set master.axis.acceleration_limit_rad_s2=500: master.axis.acceleration_limit_rad_s2 = 500 has no "
            "effect: it needs the patient's axis, slave.axis");
  EXPECT_EQ(refused({"master.therapist.K_h_nm_per_rad=5"}),
            "--set master.therapist.K_h_nm_per_rad=5: master.therapist.K_h_nm_per_rad = 5 has no effect: it needs "
            "master.therapist.grip CUSTOM");
  EXPECT_EQ(refused({"master.therapist.K_h_nm_per_rad=5", "master.therapist.grip=CUSTOM"}), "");
}

TEST(Effect, WhatBelongsToAnotherDeviceOrLawOrToNothingIsAWarning) {
  const auto said = [](const std::string& set) {
    const Sets all = said_of(set, {});
    return all.size() == 1 ? all.front() : std::to_string(all.size()) + " sentences";
  };
  EXPECT_EQ(said("network.forward.jitter_s=0.01"),
            "network.forward.jitter_s = 0.01 has no effect: it needs distribution UNIFORM or NORMAL_DISTRIBUTION");
  EXPECT_EQ(said("master.therapist.intended[0].sine_frequency_hz=2"),
            "master.therapist.intended[0].sine_frequency_hz = 2 has no effect: it needs sine_amplitude_rad");
  EXPECT_EQ(said("slave.hand.tremor_hz=6"), "slave.hand.tremor_hz = 6 has no effect: it needs slave.hand.tremor_nm");
  EXPECT_EQ(said("control.wave_matching=SLAVE_END"),
            "control.wave_matching = SLAVE_END has no effect: it needs architecture WAVE");
  EXPECT_EQ(said("slave.series_elastic.tendon_lugre={}"),
            "slave.series_elastic.tendon_lugre has no effect: it needs slave.device SERIES_ELASTIC");
}

TEST(Effect, OfAMasterBehindAnMcuWhatOnlyADirectDriveDoesIsRefused) {
  EXPECT_NO_THROW(refuse_direct_drive_of_master(completed({})));
  for (const char* set : {"master.power_stage={hold_s: 0.002 fall_s: 0.004}", "master.axis.gravity_nm=0.3"}) {
    EXPECT_THROW(refuse_direct_drive_of_master(completed({set})), std::invalid_argument) << set;
  }
}

// A scene that was completed, as recordings hold it, gives every field, most of them at their defaults.
TEST(Effect, OfACompletedSceneNothingMoreIsSaid) {
  for (const std::string& name : known_scenes()) {
    const LoadedScene loaded = load_scene(name);
    EXPECT_EQ(warnings(load_scene_text(complete_text(loaded.scene), "again").scene), warnings(loaded.scene)) << name;
    EXPECT_TRUE(refused_settings(loaded.scene).empty()) << name;
    EXPECT_TRUE(idle_settings(loaded.scene).empty()) << name;
    EXPECT_NO_THROW(refuse_virtual_time(loaded.scene)) << name;
  }
}

TEST(Effect, WhatOnlyVirtualTimeFollowsIsRefusedInRealTime) {
  for (const char* set : {"master.host={stall_s: 0.01}", "slave.host={stall_s: 0.01}", "network.peer_clock_offset_s=1",
                          "network.peer_clock_skew_ppm=50", "slave.series_elastic.serial_one_way_s=0.002"}) {
    try {
      refuse_virtual_time(completed({"slave.device=SERIES_ELASTIC", set}));
      ADD_FAILURE() << set;
    } catch (const std::invalid_argument& refusal) {
      const std::string sentence = refusal.what(), field = std::string(set).substr(0, std::string(set).find('='));
      EXPECT_TRUE(sentence.starts_with(field)) << sentence;
      EXPECT_NE(sentence.find("it needs virtual time"), std::string::npos) << sentence;
    }
  }
}

// The schema calls them so.
TEST(Effect, EveryFieldOfVirtualTimeOnlyIsRefusedInRealTime) {
  Sets all;
  moved(completed({"slave.device=SERIES_ELASTIC"}), "", all);
  for (const auto& [group, field] : {std::pair{"network", "peer_clock_offset_s"}, {"network", "peer_clock_skew_ppm"}})
    EXPECT_TRUE(std::ranges::any_of(
        all, [&](const std::string& set) { return set.starts_with(std::string(group) + "." + field); }));
  for (const std::string& set : all) {
    const std::size_t equals = set.find('=');
    const google::protobuf::Descriptor* message = scene::Scene::descriptor();
    const FieldDescriptor* field = nullptr;
    for (std::size_t begin = 0; begin < equals; begin = std::min(set.find('.', begin), equals) + 1) {
      field = message->FindFieldByName(set.substr(begin, std::min(set.find('.', begin), equals) - begin));
      message = field->message_type();
    }
    const bool only = field_info(*field).meaning().find("virtual time") != std::string::npos;
    bool refused = false;
    try {
      refuse_virtual_time(completed({"slave.device=SERIES_ELASTIC", set}));
    } catch (const ConfigError&) {
      continue;  // not alone
    } catch (const std::invalid_argument&) {
      refused = true;
    }
    EXPECT_EQ(refused, only) << set;
  }
}

}  // namespace
}  // namespace farhand
