#include "common/law/architectures.hpp"

#include <algorithm>
#include <array>
#include <stdexcept>
#include <string>

#include "common/law/automatic.hpp"
#include "common/law/four_channel.hpp"
#include "common/law/four_channel_cdob.hpp"
#include "common/law/four_channel_cdob_sdcv.hpp"
#include "common/law/four_channel_tank.hpp"
#include "common/law/model_mediated.hpp"
#include "common/law/two_channel.hpp"
#include "common/law/two_channel_po_pc.hpp"
#include "common/law/wave.hpp"

namespace farhand {
namespace {

template <template <int> class L>
constexpr LawMaker maker() {
  return {[](const LawParams& p, const FourChannelGains& K, double dt_s) -> std::unique_ptr<Law<1>> {
            return std::make_unique<L<1>>(p, K, dt_s);
          },
          sizeof(L<1>)};
}

// Under every compensation the patient's side is plain four channels.
constexpr std::array kArchitectures{
    Architecture{"FOUR_CHANNEL", "Daud 2011, 5.10-5.11", maker<FourChannel>(), maker<FourChannel>()},
    Architecture{"FOUR_CHANNEL_CDOB", "Daud 2011, 5.12-5.14", maker<FourChannelCdob>(), maker<FourChannel>()},
    Architecture{"FOUR_CHANNEL_CDOB_SDCV", "Daud 2011, 5.17", maker<FourChannelCdobSdcv>(), maker<FourChannel>()},
    Architecture{"MODEL_MEDIATED", "after Mitra & Niemeyer 2008", maker<ModelMediated>(), maker<FourChannel>()},
    Architecture{"AUTOMATIC", "the one or the other, by the network", maker<Automatic>(), maker<FourChannel>()},
    Architecture{"FOUR_CHANNEL_TANK", "Franken et al. 2011", maker<FourChannelTank>(), maker<FourChannelTank>()},
    Architecture{"TWO_CHANNEL", "Daud 2011, 4.4.1, 5.3.1", maker<TwoChannelMaster>(), maker<TwoChannelSlave>()},
    Architecture{"TWO_CHANNEL_PO_PC", "Ryu et al. 2010", maker<PassiveMaster>(), maker<PassiveSlave>()},
    Architecture{"WAVE", "Daud 2011, 4.65-4.70", maker<WaveMaster>(), maker<WaveSlave>()},
};

}  // namespace

std::span<const Architecture> architectures() noexcept { return kArchitectures; }

const Architecture& architecture(std::string_view name) {
  const auto found = std::ranges::find(kArchitectures, name, &Architecture::name);
  if (found == kArchitectures.end()) throw std::invalid_argument("there is no architecture " + std::string(name));
  return *found;
}

}  // namespace farhand
