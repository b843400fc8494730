#include "netem/lab/identify.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <iomanip>
#include <memory>
#include <numbers>
#include <ostream>
#include <stdexcept>

#include "common/config/load.hpp"
#include "common/config/schema.hpp"
#include "common/record/stamps.hpp"
#include "common/station/states.hpp"

namespace farhand {
namespace {

const char* name_of(IdentifiedSide side) {
  constexpr const char* kNames[] = {"master", "slave", "mcu"};
  return kNames[static_cast<int>(side)];
}

bool identifying(const StationSample& row) { return row.state == static_cast<int>(StationState::kIdentifying); }
bool identified(const Recorded::Series<StationSample>& rows) {
  return std::ranges::any_of(rows, [](const auto& row) { return identifying(row.second); });
}

IdentifiedSide choose_side(const Recorded& all, const std::string& asked, const std::string& file) {
  using enum IdentifiedSide;
  const auto holds = [&](IdentifiedSide side) {
    return !(side == kMaster ? all.master.empty() : side == kSlave ? all.slave.empty() : all.mcu.empty());
  };
  std::vector<IdentifiedSide> sides;
  for (const IdentifiedSide side : {kMaster, kSlave, kOrthosis}) {
    if (asked == name_of(side)) {
      if (holds(side)) return side;
      throw std::invalid_argument(file + " holds no samples of " + asked);
    }
    if (holds(side)) sides.push_back(side);
  }
  if (!asked.empty()) throw std::invalid_argument("--side " + asked + " is none of master, slave, mcu");
  if (sides.empty()) throw std::invalid_argument(file + " holds no samples of an axis");
  if (sides.size() == 1) return sides[0];
  if (identified(all.master) != identified(all.slave)) return identified(all.master) ? kMaster : kSlave;
  throw std::invalid_argument(file + " holds several axes: say --side " + name_of(sides[0]) + " or --side " +
                              name_of(sides[1]));
}

AxisModel model_of(const scene::Axis& axis) {
  return {.J_n = axis.j_n_kgm2(),
          .K_tn = axis.k_tn_nm_per_a(),
          .viscous = axis.viscous_nms_per_rad(),
          .coulomb = axis.coulomb_nm(),
          .gravity = axis.gravity_nm(),
          .gravity_angle = axis.gravity_angle_rad()};
}

// Without a known one the finest step that the recording shows.
double resolution_of(double counts_per_rev, double finest) {
  return counts_per_rev > 0 ? 2 * std::numbers::pi / counts_per_rev : finest;
}

template <class T, class Angle>
double finest_step(const Recorded::Series<T>& rows, Angle angle) {
  double finest = 1e-3;
  for (std::size_t i = 1; i < rows.size(); ++i) {
    const double step = std::abs(angle(rows[i].second) - angle(rows[i - 1].second));
    if (step > 0) finest = std::min(finest, step);
  }
  return finest;
}

template <class T>
double period_of(const Recorded::Series<T>& rows) {
  std::vector<Nanoseconds> steps;
  for (std::size_t i = 1; i < rows.size(); ++i) steps.push_back(stamp_difference(rows[i].first, rows[i - 1].first));
  if (steps.empty()) return 0.0;
  const auto middle = steps.begin() + static_cast<std::ptrdiff_t>(steps.size() / 2);
  std::nth_element(steps.begin(), middle, steps.end());
  return to_seconds(*middle);
}

// Where samples are missing, the next one follows nothing.
template <class T, class Use, class Angle, class Torque>
FreeMotionEstimate fit(const Recorded::Series<T>& rows, const FreeMotion::Params& params, Use use, Angle angle,
                       Torque torque) {
  const auto motion = std::make_unique<FreeMotion>(params);
  Nanoseconds last = 0;
  for (const auto& [t, row] : rows) {
    if (to_seconds(stamp_difference(t, last)) > 1.5 * params.dt_s || t <= last || !use(row)) motion->interrupt();
    last = t;
    if (use(row) && std::isfinite(angle(row)) && std::isfinite(torque(row))) motion->add(angle(row), torque(row));
  }
  return motion->estimate();
}

FreeMotionEstimate fit_station(const Recorded::Series<StationSample>& rows, const scene::Motor& motor) {
  // What moved in other states counts where the axis was never led to be identified: its torque is known too.
  const bool led = identified(rows);
  const auto use = [led](const StationSample& row) {
    return led ? identifying(row) : row.state != static_cast<int>(StationState::kOff);
  };
  const auto angle = [](const StationSample& row) { return row.x_rad; };
  FreeMotion::Params params;
  params.dt_s = period_of(rows);
  params.resolution = resolution_of(motor.encoder_counts_per_rev(), finest_step(rows, angle));
  return fit(rows, params, use, angle, [](const StationSample& row) { return row.command_nm; });
}

void identify_orthosis(const Recorded::Series<McuSample>& rows, Identified& found) {
  const scene::SeriesElastic& device = found.scene.slave().series_elastic();
  const auto angle = [](const McuSample& row) { return row.true_x_rad; };
  const auto torque = [](const McuSample& row) { return row.spring_torque_nm; };
  FreeMotion::Params params;
  params.dt_s = period_of(rows);
  params.resolution = resolution_of(device.joint_counts_per_rev(), finest_step(rows, angle));
  params.torque = FreeMotion::Torque::kSampled;
  found.axis = fit(
      rows, params, [](const McuSample&) { return true; }, angle, torque);
  const auto spring = std::make_unique<Spring>(params.resolution);
  for (const auto& [t, row] : rows) {
    const double deflection = row.motor_x_rad - row.true_x_rad;
    if (std::isfinite(deflection) && std::isfinite(torque(row))) spring->add(deflection, torque(row));
  }
  found.spring = spring->estimate();
  found.said_spring = device.spring_nm_per_rad();
}

struct Line {
  std::string field;  // of the scene; empty: of none
  const char* what;
  const char* unit;
  Estimate found;
};

Estimate weight_of(const FreeMotionEstimate& e) {
  const double gravity = std::hypot(e.P.value, e.Q.value);
  return {gravity, std::hypot(e.P.value * e.P.half_width, e.Q.value * e.Q.half_width) / std::max(gravity, 1e-12)};
}
Estimate angle_of_weight(const FreeMotionEstimate& e) {
  const double square = std::max(e.P.value * e.P.value + e.Q.value * e.Q.value, 1e-24);
  return {std::atan2(e.Q.value, e.P.value),
          std::hypot(e.Q.value * e.P.half_width, e.P.value * e.Q.half_width) / square};
}

// With another torque constant all of it is as much more; how sure that constant is shows with it.
FreeMotionEstimate scaled(FreeMotionEstimate e, double scale) {
  for (Estimate* one : {&e.J, &e.viscous, &e.coulomb, &e.P, &e.Q}) *one = {scale * one->value, scale * one->half_width};
  return e;
}

std::vector<Line> lines_of(const Identified& found) {
  const FreeMotionEstimate e = scaled(found.axis, found.torque_scale ? found.torque_scale->value : 1.0);
  std::vector<Line> lines;
  if (e.determined) {
    lines = {{"J_n_kgm2", "inertia", "kg m2", e.J},
             {"viscous_nms_per_rad", "viscous friction", "N m s/rad", e.viscous},
             {"coulomb_nm", "Coulomb friction", "N m", e.coulomb}};
    if (found.said.gravity > 0) {
      lines.push_back({"gravity_nm", "weight times lever", "N m", weight_of(e)});
      lines.push_back({"gravity_angle_rad", "its angle from the upright", "rad", angle_of_weight(e)});
    } else {
      lines.push_back({"", "as a spring", "N m/rad", {-e.P.value, e.P.half_width}});
      lines.push_back({"", "constant torque", "N m", {-e.Q.value, e.Q.half_width}});
    }
  }
  if (found.torque_scale) {
    const double K = found.said.K_tn;
    lines.push_back({"K_tn_nm_per_a",
                     "torque constant",
                     "N m/A",
                     {K * found.torque_scale->value, K * found.torque_scale->half_width}});
  }
  if (found.spring && found.spring->determined)
    lines.push_back({"spring_nm_per_rad", "spring", "N m/rad", found.spring->k});
  return lines;
}

// As many digits as the interval is worth, and one more.
std::string worth(double value, double half_width) {
  const int decimals = half_width > 0 ? 1 - static_cast<int>(std::floor(std::log10(half_width))) : 12;
  std::array<char, 64> text{};
  std::snprintf(text.data(), text.size(), "%.*f", std::clamp(decimals, 0, 12), value);
  return shortest(std::stod(text.data()));
}

void torque_constant(const std::string& side, const KnownInertia& known, Identified& found) {
  if (known.own_kgm2) found.torque_scale = torque_scale(found.axis.J, *known.own_kgm2);
  if (known.loaded.empty()) return;
  const Identified loaded = identify_recording(known.loaded, side);
  if (loaded.axis_misfit == Misfit::kTooLittleMotion ||
      !(loaded.axis.J.value > found.axis.J.value + loaded.axis.J.half_width + found.axis.J.half_width))
    throw std::runtime_error(known.loaded + " shows no more inertia than the recording without what was added");
  found.torque_scale = torque_scale(found.axis.J, loaded.axis.J, known.added_kgm2);
}

Json json_of(const Estimate& e) { return Json::object({{"value", e.value}, {"half_width", e.half_width}}); }

}  // namespace

Identified identify_recording(const std::string& file, const std::string& side, const KnownInertia& known) {
  const Recorded all = read_recording(file);
  Identified found;
  found.side = choose_side(all, side, file);
  found.scene = load_scene_text(all.info.scene_text(), file).scene;
  const scene::Slave& slave = found.scene.slave();
  if (found.side == IdentifiedSide::kSlave && slave.device() == scene::SERIES_ELASTIC)
    throw std::invalid_argument(file +
                                ": what turns the joint of a SERIES_ELASTIC slave is in the recording of its MCU");
  found.said = model_of(found.side == IdentifiedSide::kMaster ? found.scene.master().axis() : slave.axis());
  if (found.side == IdentifiedSide::kMaster) found.axis = fit_station(all.master, found.scene.master().motor());
  if (found.side == IdentifiedSide::kSlave) found.axis = fit_station(all.slave, slave.motor());
  if (found.side == IdentifiedSide::kOrthosis) identify_orthosis(all.mcu, found);
  found.axis_misfit = misfit(found.axis, found.said);
  if (found.spring) found.spring_misfit = misfit(*found.spring, found.said_spring);
  if (found.axis.determined) torque_constant(side, known, found);
  return found;
}

bool accepted(const Identified& found) {
  return found.axis_misfit == Misfit::kNone || (found.spring && found.spring_misfit == Misfit::kNone);
}

void print_identified(const Identified& found, std::ostream& out) {
  out << name_of(found.side) << ": " << found.axis.rows << " windows of sliding in " << found.axis.sweeps << " sweeps";
  if (found.spring) out << ", " << found.spring->branches << " loadings of the spring";
  out << '\n' << std::setprecision(4);
  for (const Line& line : lines_of(found)) {
    out << "  " << std::left << std::setw(28) << line.what << std::right << std::setw(12) << line.found.value << " +- "
        << std::left << std::setw(10) << line.found.half_width << std::right << ' ' << line.unit << '\n';
  }
  if (found.axis.determined)
    out << "  left of " << found.axis.torque << " N m RMS: " << found.axis.residual << ", of which rounding explains "
        << found.axis.expected << '\n';
  if (found.axis.determined && !found.spring && !found.torque_scale)
    out << "  all of it by K_tn_nm_per_a = " << found.said.K_tn
        << ", with which it scales; --inertia, or --loaded with --added, tells K_tn\n";
  const bool axis = found.axis_misfit == Misfit::kNone;
  const bool spring = found.spring && found.spring_misfit == Misfit::kNone;
  if (!axis) out << "refused, the axis: " << farhand::name_of(found.axis_misfit) << '\n';
  if (found.spring && !spring) out << "refused, the spring: " << farhand::name_of(found.spring_misfit) << '\n';
  const std::string path = found.side == IdentifiedSide::kMaster ? "master" : "slave";
  const auto say = [&](const char* group, bool spring_line) {
    std::string text;
    for (const Line& line : lines_of(found)) {
      if (line.field.empty() || (line.field == "spring_nm_per_rad") != spring_line) continue;
      text += (text.empty() ? "" : " ") + line.field + ": " +
              worth(line.field == "gravity_angle_rad" ? line.found.value : std::max(line.found.value, 0.0),
                    line.found.half_width);
    }
    if (!text.empty()) out << path << " { " << group << " { " << text << " } }\n";
  };
  if (axis) say("axis", false);
  if (spring) say("series_elastic", true);
}

Json json_of(const Identified& found) {
  Json all = Json::object({{"side", name_of(found.side)},
                           {"windows", found.axis.rows},
                           {"sweeps", found.axis.sweeps},
                           {"accepted", accepted(found)},
                           {"axis", found.axis_misfit == Misfit::kNone ? "" : farhand::name_of(found.axis_misfit)}});
  if (found.spring)
    all.set("spring", found.spring_misfit == Misfit::kNone ? "" : farhand::name_of(found.spring_misfit));
  for (const Line& line : lines_of(found)) {
    if (!line.field.empty()) all.set(line.field, json_of(line.found));
  }
  if (found.axis.determined) {
    all.set("stiffness_nm_per_rad", json_of(Estimate{-found.axis.P.value, found.axis.P.half_width}));
    all.set("constant_torque_nm", json_of(Estimate{-found.axis.Q.value, found.axis.Q.half_width}));
    all.set("residual_nm", found.axis.residual);
    all.set("residual_of_rounding_nm", found.axis.expected);
  }
  return all;
}

}  // namespace farhand
