#include "common/scene/station.hpp"

namespace farhand {

template class Station<FourChannel<DirectDrive<1>>>;
template class Station<FourChannel<ReferenceDrive<1>>>;
template class Station<FourChannelCdob<DirectDrive<1>>>;
template class Station<FourChannelCdob<ReferenceDrive<1>>>;
template class Station<FourChannelCdobSdcv<DirectDrive<1>>>;
template class Station<FourChannelCdobSdcv<ReferenceDrive<1>>>;
template class Station<FourChannelMediated<DirectDrive<1>>>;
template class Station<FourChannelMediated<ReferenceDrive<1>>>;

}  // namespace farhand
