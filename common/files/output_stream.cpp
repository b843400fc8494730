#include "common/files/output_stream.hpp"

#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <stdexcept>

namespace farhand {

OutputStream::Buffer::Buffer(const std::filesystem::path& wanted) : file(wanted) {
  setp(bytes.data(), bytes.data() + bytes.size());
}

int OutputStream::Buffer::sync() {
  const char* from = pbase();
  while (why == 0 && from < pptr()) {
    const ssize_t written = ::write(file.descriptor(), from, static_cast<std::size_t>(pptr() - from));
    if (written > 0) {
      from += written;
    } else if (written == 0 || errno != EINTR) {
      why = written == 0 ? ENOSPC : errno;
    }
  }
  setp(bytes.data(), bytes.data() + bytes.size());
  return why == 0 ? 0 : -1;
}

OutputStream::Buffer::int_type OutputStream::Buffer::overflow(int_type one) {
  if (sync() != 0) return traits_type::eof();
  if (!traits_type::eq_int_type(one, traits_type::eof())) sputc(traits_type::to_char_type(one));
  return traits_type::not_eof(one);
}

OutputStream::OutputStream(const std::filesystem::path& wanted) : std::ostream(nullptr), buffer_(wanted) {
  rdbuf(&buffer_);
}

OutputStream::~OutputStream() {
  if (finished_) return;
  if (kept_) {
    buffer_.file.complete();
  } else {
    buffer_.file.discard();
  }
}

void OutputStream::finish() {
  flush();
  if (!*this || buffer_.why != 0) {
    throw std::runtime_error("could not write all of " + made().file().string() + ": " +
                             std::strerror(buffer_.why != 0 ? buffer_.why : EIO));
  }
  buffer_.file.complete();
  finished_ = true;
}

}  // namespace farhand
