#include "slave/mcu/orthosis_mcu_body.hpp"

namespace farhand {
namespace mcu {

template class OrthosisCore<StoredParams>;

}  // namespace mcu
}  // namespace farhand
