// A session as a table on the screen and in files.
#pragma once

#include <iosfwd>
#include <string>

#include "common/judge/metrics.hpp"
#include "common/record/session.hpp"
#include "proto/scene.pb.h"

namespace farhand {

struct SessionOutputs {
  std::string json, csv, report, record;
  bool standard_output() const { return json == "-" || csv == "-" || report == "-" || record == "-"; }
};

void write_outputs(const SessionOutputs& to, const Session& session, const scene::Scene& scene, const Metrics& metrics);
void print_table(const Session& session, const Metrics& metrics, std::ostream& out);
int verdict_code(const Metrics& metrics);  // an exit code

}  // namespace farhand
