// What the blocks inside a station cost by themselves, on what they saw in the scene's own run.
#pragma once

#include <vector>

#include "common/record/sample.hpp"
#include "common/station/params.hpp"
#include "netem/lab/explain.hpp"
#include "netem/lab/station_inputs.hpp"

namespace farhand {

// What one side saw.
struct BlockInputs {
  bool master;
  const std::vector<StationSample>& rows;
  std::vector<Arrival> arrivals;
};

// Nothing for what is no block inside a station, or only a value in another block.
Cost cost_of_block(const Block& block, const BlockInputs& in, const StationParams& params);
// The whole law of a side, through its face.
Cost cost_of_law(const BlockInputs& in, const StationParams& params);

}  // namespace farhand
