#include "common/scene/drive_law.hpp"

namespace farhand {

template class DirectDrive<1>;

}  // namespace farhand
