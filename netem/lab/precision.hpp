// Accuracy and cost of a scene's numbers: every integrator at several steps or tolerances in the bare loop of the
// scene, against a reference whose own error is known, and against the wall clock.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "common/config/load.hpp"
#include "netem/lab/bare_run.hpp"
#include "netem/lab/cvode.hpp"
#include "netem/lab/workload.hpp"

namespace farhand {

struct PrecisionSettings {
  int runs = 5;            // each is timed so often; 0: not at all
  bool competitor = true;  // CVODE too
  bool has_cvode = farhand::has_cvode();
  bool quantised = true;  // also with encoders that have counts
  std::vector<int> steps_per_hold = {
      1, 2, 3, 4, 6, 10, 20, 50, 100};  // of the fixed step methods, between two inputs; a stiff wall adds finer ones
};

// Error of the side that is worse at the time.
struct PrecisionError {
  double end = 0, rms = 0, max = 0;
  double growth = 0;  // RMS of the last quarter over that of the worst quarter: 1 if the end is the worst
};

struct PrecisionRow {
  BareChoice choice;
  bool quantised = false;
  bool is_default = false;
  bool looser_too = false;         // looser tolerances took exactly the same steps
  std::string failure;             // empty: ran to its end
  PrecisionError position, force;  // rad, N m
  std::uint64_t steps = 0, events = 0;
  std::vector<double> wall_s;                       // per simulated second, one per run, sorted
  std::vector<double> position_error, force_error;  // by tick

  bool ok() const { return failure.empty(); }
  double wall_median() const { return wall_s.empty() ? 0 : wall_s[wall_s.size() / 2]; }
};

struct FittedOrder {
  BareMethod method;
  int theory = 0;
  int points = 0;  // fewer than 2: no fit
  double position = 0, force = 0;
  double finest_s = 0, coarsest_s = 0;  // steps that the order of position is fitted over
  bool shifts_only = false;             // the leading term of the error only shifts contacts in time
};

struct PrecisionResult {
  std::string scene, scene_text;
  double duration_s = 0, tick_s = 0, hold_s = 0;  // hold: between two inputs of the stiffer side
  int runs = 0;
  std::string methods;                               // that the scene itself asks for
  std::string reference, second;                     // their descriptions
  std::string without;                               // why CVODE is missing; empty: it is included
  PrecisionError floor_position, floor_force;        // estimated error of the reference
  PrecisionError rounding_position, rounding_force;  // of the same law and plant in double; NaN without a closed form
  PrecisionError second_position, second_force;      // the second reference against the first
  std::vector<PrecisionRow> rows;
  std::vector<FittedOrder> orders;

  const PrecisionRow* find(const BareChoice& choice, bool quantised = false) const;
};

PrecisionResult measure_precision(const LoadedScene& loaded, const PrecisionSettings& settings,
                                  const Workload& work = 1);

// Least squares of log(error) over log(step), over the finest four points that lie above their floor (10 times) and
// below saturation. The finest ones, because an order is defined in the limit. `used` are their steps, finest first.
struct OrderPoint {
  double step, error, floor;
};
double fitted_order(const std::vector<OrderPoint>& runs, double saturation, std::vector<double>& used);

// True if the leading error of a method of order p leaves the path of a contact unchanged. A step of the method is
// exp(z), z = lambda h, changed by C z^(p+1); the contact then moves with lambda (1 + C (lambda h)^p). If lambda^p is
// real, this is the same path at another speed: the axis leaves the wall with the right speed and only at another
// instant. The remaining error is a delay of a part of the contact, and an error of the next order in everything else.
// Because the contact is short against the motion that follows, the next order dominates. lambda = omega (-zeta + i
// sqrt(1 - zeta^2)) has the angle acos(-zeta): order 3 at zeta 0.5, order 4 at 0 and 0.707, order 2 at 0.
bool shifts_contacts_only(int order, double damping_ratio);

}  // namespace farhand
