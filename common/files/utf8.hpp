// Text from outside: names, arguments, sentences of a damaged file. Protobuf writes strings that are not UTF-8 but does
// not read them again, so that one bad name would make a whole recording unreadable.
#pragma once

#include <string>
#include <string_view>

namespace farhand {

// By RFC 3629: no overlong forms, no surrogates, nothing above U+10FFFF.
bool is_utf8(std::string_view text);
// Replaces each byte that belongs to no character by \xNN; the rest is unchanged.
std::string as_utf8(std::string_view text);

}  // namespace farhand
