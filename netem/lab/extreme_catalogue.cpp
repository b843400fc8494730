#include <algorithm>

#include "netem/lab/extreme_families.hpp"

namespace farhand::extreme {

Case session_case(std::string family, std::string name, Expected expected, SessionPlan plan) {
  return {std::move(family), std::move(name), std::move(expected), [plan = std::move(plan)] {
            Outcome out = judge_session(run_session(plan));
            out.energy_within = plan.energy_within;
            out.budget = plan.budget;
            return out;
          }};
}

Case bounded_case(std::string family, std::string name, double by, std::string why, Sets sets) {
  SessionPlan plan;
  plan.sets = std::move(sets);
  plan.meter_s = 25e-6;  // it hits the stops
  return {std::move(family), std::move(name), bounded(by, std::move(why)), [plan = std::move(plan)] {
            Outcome out = judge_bounded(run_session(plan));
            out.energy_within = 0.01;  // each impact falls into a piece of the balance
            return out;
          }};
}

Case session_case(std::string family, std::string name, Expected expected, Sets sets) {
  SessionPlan plan;
  plan.sets = std::move(sets);
  return session_case(std::move(family), std::move(name), std::move(expected), std::move(plan));
}

Sets both_ways(const std::vector<std::string>& settings) {
  Sets sets;
  for (const std::string& setting : settings) {
    sets.push_back("network.forward." + setting);
    sets.push_back("network.backward." + setting);
  }
  return sets;
}

Cases catalogue() {
  Cases cases;
  add_contact(cases);
  add_stiff(cases);
  add_methods(cases);
  add_control(cases);
  add_saturation(cases);
  add_network(cases);
  add_faults(cases);
  add_sensors(cases);
  // Families together, in the order in which they first appear: some are filled from several files.
  std::vector<std::string> families;
  const auto place = [&](const Case& c) {
    const auto found = std::ranges::find(families, c.family);
    if (found == families.end()) families.push_back(c.family);
    return found - families.begin();
  };
  for (const Case& c : cases) place(c);
  std::ranges::stable_sort(cases, {}, place);
  return cases;
}

}  // namespace farhand::extreme
