// The pictures of a report, in the order in which data travel. All pictures over time share one x axis, the windows and
// the events.
#pragma once

#include <string>
#include <vector>

#include "common/judge/alignment.hpp"
#include "common/record/session.hpp"
#include "common/show/plot.hpp"
#include "proto/scene.pb.h"

namespace farhand {

class Figures {
 public:
  Figures(const Session& session, const scene::Scene& scene);

  // First screen.
  std::string positions() const;
  std::string torques() const;
  std::string states() const;
  // Network and receiver.
  std::string delays(bool forward) const;  // empty if no packet was recorded
  std::string losses() const;
  std::string delay_histogram() const;
  std::string delay_distribution() const;
  std::string round_trip_and_playout() const;
  // Laws.
  std::string compensation() const;  // empty if the CDOB never compensated
  std::string alpha() const;         // empty if it was 1 throughout
  std::string law_signals() const;   // further signals of the architecture, a picture each; empty if there are none
  std::string tracking_error() const;
  std::string estimated_torques() const;  // empty if truth is not known: then torques() already shows the estimates
  std::string force_error() const;
  std::string torque_against_angle() const;
  std::string limits() const;  // empty if none acted

  const AlignedSession& aligned() const { return aligned_; }
  const std::vector<SessionEvent>& events() const { return events_; }  // numbered from 1 in the pictures

 private:
  Plot over_time(const std::string& title, const std::string& y_label, double height = 230) const;
  std::string error_over_time(const std::string& title, const std::string& y_label, const std::vector<double>& t_s,
                              const std::vector<double>& error, double limit) const;

  const Session& session_;
  const scene::Scene& scene_;
  AlignedSession aligned_;
  std::vector<SessionEvent> events_;
  Landmarks landmarks_;
  PlotAxis time_;
};

// Quantiles of the one-way delay of one direction, for the table beside the pictures; nearest rank.
struct DelayQuantiles {
  std::size_t packets = 0, lost = 0;
  std::vector<double> asked_ms, achieved_ms;  // at kDelayShares; empty if nothing arrived
};
inline constexpr double kDelayShares[] = {0.0, 0.05, 0.5, 0.95, 0.99, 1.0};
DelayQuantiles delay_quantiles(const Session& session, bool forward);

}  // namespace farhand
