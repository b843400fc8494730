// Costs of the single blocks inside a station, on their inputs from the scene's own run.
#pragma once

#include <vector>

#include "common/record/sample.hpp"
#include "common/station/params.hpp"
#include "netem/lab/explain.hpp"
#include "netem/lab/station_inputs.hpp"

namespace farhand {

// Inputs of the blocks of one side.
struct BlockInputs {
  bool master;
  const std::vector<StationSample>& rows;
  std::vector<Arrival> arrivals;
};

// Unmeasured for a block that is not inside a station, or is only a value in another block.
Cost cost_of_block(const Block& block, const BlockInputs& in, const StationParams& params);
// Cost of the whole law of a side, through its interface.
Cost cost_of_law(const BlockInputs& in, const StationParams& params);

}  // namespace farhand
