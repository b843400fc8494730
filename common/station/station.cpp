#include "common/station/station.hpp"

namespace farhand {

template class Station<DirectIo<1>>;
template class Station<ReferenceIo<1>>;

}  // namespace farhand
