// A station together with its law, for owners of both: a side of a program, the lab, a test. Made before the loop.
#pragma once

#include <cstddef>
#include <memory>

#include "common/law/architectures.hpp"
#include "common/station/station.hpp"

namespace farhand {

// The objects that a station uses beside its own blocks.
struct StationParts {
  const LawMaker& maker;
  std::unique_ptr<Law<1>> law;
  std::unique_ptr<Identifying> identifying;  // null unless the scene asks for it

  explicit StationParts(const StationParams& p)
      : maker(p.role == Role::kLeader ? architecture(p.architecture).master : architecture(p.architecture).slave),
        law(maker.make(p.control.law, p.control.drive.K, p.control.drive.dt_s)),
        identifying(p.engagement.identification ? std::make_unique<Identifying>(p.identifying, p.control.drive)
                                                : nullptr) {}
};

// Io: DirectIo<1> or ReferenceIo<1>.
template <class Io>
class OwnedStation : private StationParts, public Station<Io> {
 public:
  // Throws std::invalid_argument if there is no such architecture.
  explicit OwnedStation(const StationParams& p) : StationParts(p), Station<Io>(p, *law, identifying.get()) {}

  const LawNeeds& needs() const noexcept { return law->needs(); }

  std::size_t bytes() const noexcept { return sizeof(Station<Io>) + bytes_beside(); }
  // Bytes of the objects beside this one: the law and the identification.
  std::size_t bytes_beside() const noexcept { return maker.bytes + (identifying ? sizeof(Identifying) : 0); }
};

}  // namespace farhand
