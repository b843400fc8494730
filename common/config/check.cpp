#include "common/config/check.hpp"

#include <google/protobuf/text_format.h>

#include <algorithm>
#include <boost/nowide/utf/utf.hpp>
#include <cmath>
#include <stdexcept>

#include "common/config/effect.hpp"
#include "common/config/scene_kind.hpp"
#include "common/config/schema.hpp"
#include "common/device/line_age.hpp"

namespace farhand {
namespace {

using google::protobuf::FieldDescriptor;
using google::protobuf::Message;
using google::protobuf::Reflection;
using google::protobuf::TextFormat;

class Checker {
 public:
  void complain(const std::string& path, const std::string& sentence) { complaints_.push_back({path, sentence}); }
  std::vector<Complaint> take() { return std::move(complaints_); }

  void complete(Message& message, const std::string& prefix) {
    const Reflection& reflection = *message.GetReflection();
    for (int i = 0; i < message.GetDescriptor()->field_count(); ++i) {
      const FieldDescriptor& field = *message.GetDescriptor()->field(i);
      const std::string path = prefix + field.name();
      if (field.is_repeated()) {
        for (int k = 0; k < reflection.FieldSize(message, &field); ++k)
          complete(*reflection.MutableRepeatedMessage(&message, &field, k), path + "[" + std::to_string(k) + "].");
      } else if (!reflection.HasField(message, &field) && may_stay_absent(field)) {
        continue;
      } else if (field.message_type() != nullptr) {
        complete(*reflection.MutableMessage(&message, &field), path + ".");
      } else if (reflection.HasField(message, &field)) {
        check_value(message, field, path);
      } else if (field_info(field).has_default_text()) {
        TextFormat::ParseFieldValueFromString(field_info(field).default_text(), &field, &message);
      } else {
        complain(path, path + " is missing and has no default; give " + allowed_text(field) + " (" +
                           field_info(field).meaning() + ")");
      }
    }
  }

 private:
  void check_value(const Message& message, const FieldDescriptor& field, const std::string& path) {
    const Reflection& reflection = *message.GetReflection();
    switch (field.cpp_type()) {
      case FieldDescriptor::CPPTYPE_DOUBLE:
        return check_number(reflection.GetDouble(message, &field), field, path);
      case FieldDescriptor::CPPTYPE_UINT64:
        // Compared as integers: as a double, 2^53 + 1 would pass for 2^53.
        if (const auto value = reflection.GetUInt64(message, &field);
            value > static_cast<std::uint64_t>(field_info(field).max()))
          complain_value(std::to_string(value), field, path);
        return;
      case FieldDescriptor::CPPTYPE_ENUM: {
        // proto3 enums are open: a number that no choice has is kept by the parser.
        const int number = reflection.GetEnumValue(message, &field);
        if (number == 0 || field.enum_type()->FindValueByNumber(number) == nullptr)
          complain(path, path + " must be " + allowed_text(field));
        return;
      }
      case FieldDescriptor::CPPTYPE_STRING:
        return check_line(reflection.GetString(message, &field), path);
      default:
        return;
    }
  }

  void check_number(double value, const FieldDescriptor& field, const std::string& path) {
    const scene::FieldInfo& info = field_info(field);
    const bool inside = value >= info.min() && value <= info.max() && !(info.above_min() && value == info.min());
    const bool whole = !info.integer() || value == std::floor(value);
    if (!std::isfinite(value) || !inside || !whole) complain_value(shortest(value), field, path);
  }

  void complain_value(const std::string& value, const FieldDescriptor& field, const std::string& path) {
    complain(path, path + " = " + value + " is not allowed; give " + allowed_text(field) + " (" +
                       field_info(field).meaning() + ")");
  }

  // Text goes into reports, tables and recordings: valid UTF-8, one line, no control characters. Escapes could bring in
  // anything.
  void check_line(const std::string& text, const std::string& path) {
    using Utf8 = boost::nowide::utf::utf_traits<char>;
    for (auto next = text.begin(); next != text.end();) {
      const auto point = Utf8::decode(next, text.end());
      if (!boost::nowide::utf::is_valid_codepoint(point)) return complain(path, path + " is not valid UTF-8 text");
      if (point < 0x20 || point == 0x7f) return complain(path, path + " must be one line without control characters");
    }
  }

  std::vector<Complaint> complaints_;
};

// first < second, both known (what is missing has been complained about).
template <class M>
void check_order(Checker& checker, const M& message, const std::string& prefix, const char* first, const char* second,
                 bool equal_allowed = false) {
  const auto* low = M::descriptor()->FindFieldByName(first);
  const auto* high = M::descriptor()->FindFieldByName(second);
  const Reflection& reflection = *message.GetReflection();
  if (!reflection.HasField(message, low) || !reflection.HasField(message, high)) return;
  const double a = reflection.GetDouble(message, low), b = reflection.GetDouble(message, high);
  if (a < b || (equal_allowed && a == b)) return;
  checker.complain(prefix + first, prefix + first + " = " + shortest(a) + " must be " +
                                       (equal_allowed ? "at most " : "below ") + second + " = " + shortest(b));
}

void check_window(Checker& checker, const scene::Window& window, const std::string& prefix, double duration_s) {
  check_order(checker, window, prefix, "from_s", "until_s");
  if (window.until_s() > duration_s)
    checker.complain(prefix + "until_s", prefix + "until_s = " + shortest(window.until_s()) +
                                             " lies after the end of the run, duration_s = " + shortest(duration_s));
}

void check_path(Checker& checker, const scene::Path& path, const std::string& prefix) {
  check_order(checker, path, prefix, "cut_from_s", "cut_until_s", true);
  // Cutting such a delay at 0 would silently raise its mean.
  if (path.distribution() == scene::UNIFORM && path.jitter_s() > path.delay_s())
    checker.complain(prefix + "jitter_s", prefix + "jitter_s = " + shortest(path.jitter_s()) +
                                              " must be at most delay_s = " + shortest(path.delay_s()) +
                                              " with distribution UNIFORM: no packet arrives before it is sent");
}

// One friction at a place.
template <class M>
void check_friction(Checker& checker, const M& message, double other, const std::string& prefix, const char* lugre,
                    const char* other_name) {
  const auto* field = M::descriptor()->FindFieldByName(lugre);
  if (!message.GetReflection()->HasField(message, field)) return;
  const auto& friction = dynamic_cast<const scene::LuGre&>(message.GetReflection()->GetMessage(message, field));
  const std::string path = prefix + lugre;
  check_order(checker, friction, path + ".", "F_c_nm", "F_s_nm", true);
  if (other > 0)
    checker.complain(
        path, path + " and " + other_name + " = " + shortest(other) + " are two frictions at one place; give one");
}

// Every device starts at 0 rad, at rest: not inside a stop.
template <class M>
void check_start(Checker& checker, const M& device, const std::string& prefix) {
  if (device.stop_min_rad() >= device.stop_max_rad()) return;  // said already
  if (device.stop_min_rad() > 0)
    checker.complain(prefix + "stop_min_rad", prefix + "stop_min_rad = " + shortest(device.stop_min_rad()) +
                                                  " must be at most 0: a device starts at 0 rad");
  if (device.stop_max_rad() < 0)
    checker.complain(prefix + "stop_max_rad", prefix + "stop_max_rad = " + shortest(device.stop_max_rad()) +
                                                  " must be at least 0: a device starts at 0 rad");
}

// One frame per tick, and its echo.
void check_serial_line(Checker& checker, const scene::Scene& scene) {
  if (scene.slave().device() != scene::SERIES_ELASTIC) return;
  const std::string tick = "tick_s = " + shortest(scene.tick_s());
  if (scene.tick_s() < LineAge::kShortestTick)
    checker.complain("tick_s", tick +
                                   " is shorter than a frame on the serial line of a SERIES_ELASTIC slave takes: give "
                                   "at least 0.00087 s");
  if (scene.tick_s() > LineAge::kLongestTick)
    checker.complain("tick_s", tick +
                                   " is too long for a SERIES_ELASTIC slave: a command and its echo may take 8 ms, and "
                                   "are seen a tick late; give at most " +
                                   shortest(LineAge::kLongestTick) + " s");
}

// A lead of the motion to follow is a torque only where both gains are there.
void check_homing(Checker& checker, const scene::Axis& axis, const scene::Control& control, const std::string& prefix) {
  if (!axis.has_homing()) return;
  const scene::Homing& homing = axis.homing();
  if (homing.stop_rad() == homing.back_rad())
    checker.complain(prefix + "homing.stop_rad", prefix + "homing.stop_rad = " + shortest(homing.stop_rad()) +
                                                     " is also back_rad: in which direction is the stop?");
  if (control.k_p_per_s2() == 0 || control.k_f_per_kgm2() == 0)
    checker.complain(prefix + "homing", prefix + "homing needs control.K_p_per_s2 and control.K_f_per_kgm2 above 0");
}

// Where the torque on the joint is known, and is enough.
void check_identification(Checker& checker, const scene::Axis& axis, const scene::Control& control,
                          const std::string& prefix, bool direct) {
  if (!axis.has_identification()) return;
  const scene::Identification& identification = axis.identification();
  const std::string name = prefix + "identification";
  if (!direct)
    checker.complain(name, name +
                               " needs a DIRECT_DRIVE: what turns the joint of an orthosis is known to its MCU; "
                               "identify it from the MCU's recording");
  if (control.k_p_per_s2() == 0) checker.complain(name, name + " needs control.K_p_per_s2 above 0");
  const double needed = axis.j_n_kgm2() * identification.acceleration_rad_s2() + axis.coulomb_nm();
  if (needed > 0.8 * identification.torque_nm())
    checker.complain(name + ".torque_nm", name + ".torque_nm = " + shortest(identification.torque_nm()) +
                                              " N m is too little for its acceleration_rad_s2: give at least " +
                                              shortest(needed / 0.8) + " N m");
}

// A drive that lets go before the next command could come would tremble.
void check_power_stage(Checker& checker, const scene::PowerStage& stage, double tick_s, const std::string& prefix) {
  if (!stage.has_hold_s() || stage.hold_s() >= tick_s) return;
  checker.complain(prefix + "hold_s", prefix + "hold_s = " + shortest(stage.hold_s()) + " must be at least tick_s = " +
                                          shortest(tick_s) + ": a torque is held from one command to the next");
}

void check_host(Checker& checker, bool has, const scene::Host& host, const std::string& prefix) {
  if (has) check_order(checker, host, prefix, "stall_s", "every_s");
}

void check_together(Checker& checker, const scene::Scene& scene) {
  check_power_stage(checker, scene.master().power_stage(), scene.tick_s(), "master.power_stage.");
  check_power_stage(checker, scene.slave().power_stage(), scene.tick_s(), "slave.power_stage.");
  check_host(checker, scene.master().has_host(), scene.master().host(), "master.host.");
  check_host(checker, scene.slave().has_host(), scene.slave().host(), "slave.host.");
  check_order(checker, scene.control(), "control.", "f_1_nm", "f_2_nm");
  check_order(checker, scene.master().axis(), "master.axis.", "range_min_rad", "range_max_rad");
  check_order(checker, scene.slave().axis(), "slave.axis.", "range_min_rad", "range_max_rad");
  check_homing(checker, scene.master().axis(), scene.control(), "master.axis.");
  check_homing(checker, scene.slave().axis(), scene.control(), "slave.axis.");
  check_identification(checker, scene.master().axis(), scene.control(), "master.axis.", true);
  check_identification(checker, scene.slave().axis(), scene.control(), "slave.axis.",
                       scene.slave().device() != scene::SERIES_ELASTIC);
  check_order(checker, scene.master().motor(), "master.motor.", "stop_min_rad", "stop_max_rad");
  check_order(checker, scene.slave().motor(), "slave.motor.", "stop_min_rad", "stop_max_rad");
  check_order(checker, scene.slave().series_elastic(), "slave.series_elastic.", "stop_min_rad", "stop_max_rad");
  check_order(checker, scene.slave().limits(), "slave.limits.", "room_c", "surface_limit_c");
  check_start(checker, scene.master().motor(), "master.motor.");
  if (scene.slave().device() == scene::SERIES_ELASTIC)
    check_start(checker, scene.slave().series_elastic(), "slave.series_elastic.");
  else
    check_start(checker, scene.slave().motor(), "slave.motor.");
  check_serial_line(checker, scene);
  const scene::Control& control = scene.control();
  if (scene.architecture() == scene::WAVE && (control.position_scale() != 1 || control.force_scale() != 1))
    checker.complain("control.position_scale",
                     "control.position_scale and control.force_scale must be 1 with architecture WAVE: a wave has one "
                     "impedance on both sides");
  if (control.sdcv_from_patient() && scene.architecture() != scene::FOUR_CHANNEL_CDOB_SDCV)
    checker.complain("control.sdcv_from_patient",
                     "control.sdcv_from_patient = true needs architecture FOUR_CHANNEL_CDOB_SDCV, and this one is " +
                         scene::Architecture_Name(scene.architecture()) + ", which has no f_1 and f_2");
  if (scene.slave().has_hand()) {
    check_order(checker, scene.slave().hand(), "slave.hand.", "from_s", "until_s");
    check_order(checker, scene.slave().hand(), "slave.hand.", "relaxed_nm_per_rad", "stiffness_nm_per_rad", true);
  }
  for (const bool master : {true, false}) {
    const scene::Motor& motor = master ? scene.master().motor() : scene.slave().motor();
    check_friction(checker, motor, motor.coulomb_nm(), master ? "master.motor." : "slave.motor.", "lugre",
                   "coulomb_nm");
  }
  const scene::SeriesElastic& elastic = scene.slave().series_elastic();
  check_friction(checker, elastic, elastic.tendon_friction_nm(), "slave.series_elastic.", "tendon_lugre",
                 "tendon_friction_nm");
  check_path(checker, scene.network().forward(), "network.forward.");
  check_path(checker, scene.network().backward(), "network.backward.");
  if (scene.windows().has_free()) check_window(checker, scene.windows().free(), "windows.free.", scene.duration_s());
  if (scene.windows().has_contact())
    check_window(checker, scene.windows().contact(), "windows.contact.", scene.duration_s());

  const scene::Therapist& therapist = scene.master().therapist();
  if (therapist.has_reaction() && therapist.grip() == scene::CUSTOM && therapist.k_h_nm_per_rad() == 0)
    checker.complain("master.therapist.reaction",
                     "master.therapist.reaction needs master.therapist.K_h_nm_per_rad above 0: torque is felt by it");
  for (int i = 0; i < scene.master().therapist().intended_size(); ++i) {
    const scene::Movement& movement = scene.master().therapist().intended(i);
    const std::string path = "master.therapist.intended[" + std::to_string(i) + "]";
    if (movement.has_ramp_to_rad() && movement.has_sine_amplitude_rad())
      checker.complain(
          path,
          path + " gives both ramp_to_rad and sine_amplitude_rad; one movement is a ramp, a sine or (neither) a hold");
  }
  for (int i = 1; i < scene.operator_acts_size(); ++i) {
    const double before = scene.operator_acts(i - 1).at_s(), at = scene.operator_acts(i).at_s();
    const std::string path = "operator_acts[" + std::to_string(i) + "].at_s";
    if (at < before)
      checker.complain(path, path + " = " + shortest(at) + " lies before the act above it, at_s = " + shortest(before));
  }
}

}  // namespace

void refuse(const std::vector<Complaint>& complaints) {
  std::string all;
  for (const Complaint& complaint : complaints) all += (all.empty() ? "" : "\n") + complaint.sentence;
  if (!all.empty()) throw std::invalid_argument(all);
}

std::vector<Complaint> complete_and_check(scene::Scene& scene) {
  Checker checker;
  const bool named = scene.control().has_g_v_rad_s();
  checker.complete(scene, "");
  if (!named) scene.mutable_control()->set_g_v_rad_s(default_g_v(scene));
  check_together(checker, scene);
  for (const Complaint& complaint : refused_settings(scene)) checker.complain(complaint.path, complaint.sentence);
  return checker.take();
}

}  // namespace farhand
