// Apart from the other stations, as torque_scenes.cpp is.
#include "common/scene/passive_scenes.hpp"

#include "common/scene/station.hpp"

namespace farhand {

template struct FourChannelTank<DirectDrive<1>>;
template struct FourChannelTank<ReferenceDrive<1>>;
template struct PassiveMaster<DirectDrive<1>>;
template struct PassiveSlave<DirectDrive<1>>;
template struct PassiveMaster<ReferenceDrive<1>>;
template struct PassiveSlave<ReferenceDrive<1>>;
template class Station<FourChannelTank<DirectDrive<1>>>;
template class Station<FourChannelTank<ReferenceDrive<1>>>;
template class Station<PassiveMaster<DirectDrive<1>>>;
template class Station<PassiveSlave<DirectDrive<1>>>;
template class Station<PassiveMaster<ReferenceDrive<1>>>;
template class Station<PassiveSlave<ReferenceDrive<1>>>;

}  // namespace farhand
