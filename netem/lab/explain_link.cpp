#include "netem/lab/explain_link.hpp"

#include "common/link/codec.hpp"
#include "netem/link_params.hpp"
#include "netem/pending.hpp"

namespace farhand {

std::size_t carry(const scene::Scene& scene, std::size_t ticks) {
  const scene::Path& path = scene.network().forward();
  const std::array<std::byte, PacketCodec<1>::kSize> bytes{};
  const Nanoseconds tick = from_seconds(scene.tick_s());
  LinkModel model(link_params(path), scene.seed(), LinkDirection::kForward);
  PendingDatagrams way(datagrams_on_way(path, scene.tick_s()));
  std::size_t came = 0;
  for (std::size_t k = 0; k < ticks; ++k) {
    const Nanoseconds now = static_cast<Nanoseconds>(k) * tick;
    for (; !way.empty() && way.due() <= now; ++came) way.pop();
    const LinkModel::Fate fate = model.offer(now);
    if (!fate.lost) way.push(now + fate.delay, bytes);
  }
  return came;
}

std::size_t link_bytes() { return sizeof(LinkModel) + sizeof(PendingDatagrams); }

}  // namespace farhand
