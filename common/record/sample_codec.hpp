// Converts between the plain structs that a loop fills and the messages of record.proto in a file. Values that a side
// cannot know (NaN in true_*) are absent in the file.
#pragma once

#include "common/record/session.hpp"
#include "common/signal/joints.hpp"
#include "proto/record.pb.h"

namespace farhand {

// Times of samples travel beside them, in nanoseconds: t_s of the structs is not used here.
void encode(Nanoseconds t, const StationSample& sample, record::StationSample& message);
void encode(Nanoseconds t, const LinkSample& sample, record::LinkSample& message);
void encode(Nanoseconds t, const McuSample& sample, record::McuSample& message);
void encode(const StationCounters& counters, record::Counters& message);
void encode(const DeviceFriction& friction, record::RunInfo& info);  // nothing if it is absent

StationSample decode(const record::StationSample& message);
LinkSample decode(const record::LinkSample& message);
McuSample decode(const record::McuSample& message);
StationCounters decode(const record::Counters& message);
DeviceFriction friction_of(const record::RunInfo& info);

// Names of the law's signals of a side. A recording that was made before they had names has kUnnamedSignals.
std::vector<std::string> signals_of(const record::RunInfo& info, bool master);
void name_signals(const std::vector<std::string>& master, const std::vector<std::string>& slave, record::RunInfo& info);

}  // namespace farhand
