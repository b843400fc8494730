#include "common/scene/drive_law.hpp"
#include "common/scene/four_channel.hpp"

namespace farhand {

template class DirectDrive<1>;
template struct FourChannel<DirectDrive<1>>;
template struct FourChannelCdob<DirectDrive<1>>;
template struct FourChannelCdob<ReferenceDrive<1>>;
template struct FourChannelCdobSdcv<DirectDrive<1>>;
template struct FourChannelCdobSdcv<ReferenceDrive<1>>;
template struct FourChannelMediated<DirectDrive<1>>;
template struct FourChannelMediated<ReferenceDrive<1>>;

}  // namespace farhand
