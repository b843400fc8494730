#include "common/law/architectures.hpp"

#include <algorithm>
#include <array>
#include <stdexcept>

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

template <class L>
constexpr std::span<const LawSignal> signals_of() {
  if constexpr (requires { L::kSignals; }) {
    static_assert(L::kSignals.size() <= kMostLawSignals);
    return L::kSignals;
  } else {
    return {};
  }
}

template <class L>
constexpr std::span<const LawBlock> blocks_of() {
  if constexpr (requires { L::kBlocks; }) return L::kBlocks;
  return {};
}

template <template <int> class L>
constexpr LawMaker maker() {
  return {[](const LawParams& p, const FourChannelGains& K, double dt_s) -> std::unique_ptr<Law<1>> {
            return std::make_unique<L<1>>(p, K, dt_s);
          },
          sizeof(L<1>), signals_of<L<1>>(), blocks_of<L<1>>()};
}

// The patient's side of an architecture whose packets tell the previous sample.
constexpr LawMaker filled_four_channel() {
  LawMaker maker = farhand::maker<FourChannel>();
  maker.make = [](const LawParams& p, const FourChannelGains& K, double dt_s) -> std::unique_ptr<Law<1>> {
    return std::make_unique<FourChannel<1>>(p, K, dt_s, LawNeeds{.previous = true});
  };
  return maker;
}

// Under every compensation the patient's side is plain four channels.
constexpr std::array kArchitectures{
    Architecture{"FOUR_CHANNEL", "Daud 2011, 5.10-5.11", maker<FourChannel>(), maker<FourChannel>()},
    Architecture{"FOUR_CHANNEL_CDOB", "Daud 2011, 5.12-5.14", maker<FourChannelCdob>(), maker<FourChannel>()},
    Architecture{"FOUR_CHANNEL_CDOB_SDCV", "Daud 2011, 5.17", maker<FourChannelCdobSdcv>(), maker<FourChannel>()},
    Architecture{"MODEL_MEDIATED", "after Mitra & Niemeyer 2008", maker<ModelMediated>(), filled_four_channel()},
    Architecture{"AUTOMATIC", "the one or the other, by the network", maker<Automatic>(), filled_four_channel()},
    Architecture{"FOUR_CHANNEL_TANK", "Franken et al. 2011", maker<FourChannelTank>(), maker<FourChannelTank>()},
    Architecture{"TWO_CHANNEL", "Daud 2011, 4.4.1, 5.3.1", maker<TwoChannelMaster>(), maker<TwoChannelSlave>()},
    Architecture{"TWO_CHANNEL_PO_PC", "Ryu et al. 2010", maker<PassiveMaster>(), maker<PassiveSlave>()},
    Architecture{"WAVE", "Daud 2011, 4.65-4.70", maker<WaveMaster>(), maker<WaveSlave>()},
};

}  // namespace

std::span<const Architecture> architectures() noexcept { return kArchitectures; }

const Architecture* find_architecture(std::string_view name) noexcept {
  const auto found = std::ranges::find(kArchitectures, name, &Architecture::name);
  return found == kArchitectures.end() ? nullptr : &*found;
}

const Architecture& architecture(std::string_view name) {
  const Architecture* found = find_architecture(name);
  if (found == nullptr) throw std::invalid_argument("there is no architecture " + std::string(name));
  return *found;
}

const LawBlock* block_of(const LawMaker& law, std::string_view name) noexcept {
  const auto found = std::ranges::find(law.blocks, name, &LawBlock::name);
  return found == law.blocks.end() ? nullptr : &*found;
}

bool reads(const Architecture& laws, std::string_view setting) noexcept {
  const auto reads = [setting](const LawBlock& block) {
    return std::ranges::find(block.settings, setting) != block.settings.end();
  };
  return std::ranges::any_of(laws.master.blocks, reads) || std::ranges::any_of(laws.slave.blocks, reads);
}

const LawSignal* signal_of(const Architecture& laws, std::string_view name) noexcept {
  for (const auto& signals : {laws.master.signals, laws.slave.signals}) {
    const auto found = std::ranges::find(signals, name, &LawSignal::name);
    if (found != signals.end()) return &*found;
  }
  return nullptr;
}

std::vector<std::string> names_of(std::span<const LawSignal> signals) {
  std::vector<std::string> names;
  for (const LawSignal& signal : signals) names.emplace_back(signal.name);
  return names;
}

}  // namespace farhand
