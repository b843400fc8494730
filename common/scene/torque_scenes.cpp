// Apart from the other stations: what a compiler inlines depends on how much stands in one source.
#include "common/scene/torque_scenes.hpp"

#include "common/scene/station.hpp"

namespace farhand {

template struct TwoChannelMaster<DirectDrive<1>>;
template struct TwoChannelMaster<ReferenceDrive<1>>;
template struct TwoChannelSlave<DirectDrive<1>>;
template struct TwoChannelSlave<ReferenceDrive<1>>;
template struct WaveMaster<DirectDrive<1>>;
template struct WaveMaster<ReferenceDrive<1>>;
template struct WaveSlave<DirectDrive<1>>;
template struct WaveSlave<ReferenceDrive<1>>;
template class Station<TwoChannelMaster<DirectDrive<1>>>;
template class Station<TwoChannelMaster<ReferenceDrive<1>>>;
template class Station<TwoChannelSlave<DirectDrive<1>>>;
template class Station<TwoChannelSlave<ReferenceDrive<1>>>;
template class Station<WaveMaster<DirectDrive<1>>>;
template class Station<WaveMaster<ReferenceDrive<1>>>;
template class Station<WaveSlave<DirectDrive<1>>>;
template class Station<WaveSlave<ReferenceDrive<1>>>;

}  // namespace farhand
