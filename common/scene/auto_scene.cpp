// Apart from the other stations, as torque_scenes.cpp is.
#include "common/scene/auto_scene.hpp"

#include "common/scene/station.hpp"

namespace farhand {

template struct FourChannelAuto<DirectDrive<1>>;
template struct FourChannelAuto<ReferenceDrive<1>>;
template class Station<FourChannelAuto<DirectDrive<1>>>;
template class Station<FourChannelAuto<ReferenceDrive<1>>>;

}  // namespace farhand
