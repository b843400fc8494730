#include "common/station/drive_law.hpp"

namespace farhand {

template class DirectDrive<1>;

}  // namespace farhand
