#include "common/link/receiver.hpp"

namespace farhand {

template class Receiver<1>;

}  // namespace farhand
