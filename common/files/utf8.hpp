// Text from outside: names, arguments, sentences of a damaged file. Protobuf writes strings that are no UTF-8 but reads
// them no more, so that one bad name would cost a whole recording.
#pragma once

#include <string>
#include <string_view>

namespace farhand {

// By RFC 3629: no overlong forms, no surrogates, nothing above U+10FFFF.
bool is_utf8(std::string_view text);
// Each byte that belongs to no character as \xNN; all else as it is.
std::string as_utf8(std::string_view text);

}  // namespace farhand
