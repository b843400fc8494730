#include "common/secure/pairing_key.hpp"

#include <fcntl.h>
#include <openssl/crypto.h>
#include <openssl/evp.h>
#include <openssl/hmac.h>
#include <openssl/rand.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <span>
#include <stdexcept>

#include "common/files/output.hpp"

namespace farhand {
namespace {

constexpr std::string_view kDigits = "0123456789abcdef";

std::string to_hex(std::span<const std::uint8_t> bytes) {
  std::string text;
  for (const std::uint8_t byte : bytes) {
    text += kDigits[byte >> 4];
    text += kDigits[byte & 15];
  }
  return text;
}

// One label, one use: what is shown for one purpose says nothing about another.
std::array<std::uint8_t, 32> derive(const PairingKey::Bytes& key, std::string_view label) {
  std::array<std::uint8_t, 32> out{};
  unsigned size = 0;
  if (HMAC(EVP_sha256(), key.data(), static_cast<int>(key.size()), reinterpret_cast<const unsigned char*>(label.data()),
           label.size(), out.data(), &size) == nullptr) {
    throw std::runtime_error("OpenSSL cannot compute HMAC-SHA256");
  }
  return out;
}

// Sixteen bits as consonant, vowel, consonant, vowel, consonant: no two words sound alike more than by one sound.
std::string speakable(unsigned bits) {
  constexpr std::string_view kConsonants = "bdfghjklmnprstvz", kVowels = "aiou";
  return {kConsonants[bits >> 12 & 15], kVowels[bits >> 10 & 3], kConsonants[bits >> 6 & 15], kVowels[bits >> 4 & 3],
          kConsonants[bits & 15]};
}

class File {
 public:
  File(const std::filesystem::path& path, int flags)
      : fd_(::open(path.c_str(), flags | O_NOFOLLOW | O_CLOEXEC | O_NONBLOCK, 0600)) {}
  ~File() {
    if (fd_ >= 0) ::close(fd_);
  }
  File(const File&) = delete;
  File& operator=(const File&) = delete;
  int fd() const { return fd_; }

 private:
  int fd_;
};

[[noreturn]] void refuse(const std::filesystem::path& file, const std::string& why) {
  throw std::runtime_error("key file " + file.string() + ": " + why);
}

std::string octal(mode_t mode) {
  std::string text = "0";
  for (int shift = 6; shift >= 0; shift -= 3) text += static_cast<char>('0' + (mode >> shift & 7));
  return text;
}

// What is wrong with who may read it, judged on the open file so that nothing is exchanged in between.
void require_private(const std::filesystem::path& file, int fd) {
  struct stat info {};
  if (::fstat(fd, &info) != 0) refuse(file, std::strerror(errno));
  if (!S_ISREG(info.st_mode)) refuse(file, "is not a regular file");
  if (info.st_uid != ::geteuid()) {
    refuse(file, "belongs to user " + std::to_string(info.st_uid) + ", but this program runs as user " +
                     std::to_string(::geteuid()) + "; a key must belong to whoever uses it");
  }
  const mode_t mode = info.st_mode & 07777;
  if (mode != 0600) {
    refuse(file, "has mode " + octal(mode) +
                     ", so that others may know the key; revoke it and pair again, or if nobody "
                     "can have read it: chmod 600 " +
                     file.string());
  }
}

void write_whole(const std::filesystem::path& file, int fd, std::string_view text) {
  while (!text.empty()) {
    const ssize_t written = ::write(fd, text.data(), text.size());
    if (written < 0 && errno == EINTR) continue;
    if (written < 0) refuse(file, std::strerror(errno));
    text.remove_prefix(static_cast<std::size_t>(written));
  }
  if (::fsync(fd) != 0) refuse(file, std::strerror(errno));
}

void require_open(const std::filesystem::path& file, const File& opened) {
  if (opened.fd() >= 0) return;
  if (errno == ENOENT) {
    refuse(
        file,
        "does not exist; make a key with 'farhand-slave pair' and bring it to the other side with 'farhand-master pair "
        "--import FILE'");
  }
  refuse(file, errno == ELOOP ? "is a symbolic link" : std::strerror(errno));
}

}  // namespace

PairingKey::~PairingKey() { OPENSSL_cleanse(bytes_.data(), bytes_.size()); }

PairingKey PairingKey::random() {
  Bytes bytes{};
  if (RAND_priv_bytes(bytes.data(), static_cast<int>(bytes.size())) != 1) {
    throw std::runtime_error("OpenSSL has no random numbers");
  }
  return PairingKey(bytes);
}

PairingKey PairingKey::from_text(std::string_view text) {
  constexpr std::string_view kSpace = " \t\r\n";
  const std::size_t begin = text.find_first_not_of(kSpace);
  text = begin == std::string_view::npos ? std::string_view{} : text.substr(begin);
  text = text.substr(0, text.find_last_not_of(kSpace) + 1);
  if (text.size() != 2 * kBytes) {
    throw std::invalid_argument("a key is " + std::to_string(2 * kBytes) + " hexadecimal digits, this has " +
                                std::to_string(text.size()) + " characters");
  }
  Bytes bytes{};
  for (std::size_t i = 0; i < text.size(); ++i) {
    const char lower = text[i] >= 'A' && text[i] <= 'F' ? static_cast<char>(text[i] - 'A' + 'a') : text[i];
    const std::size_t digit = kDigits.find(lower);
    if (digit == std::string_view::npos) throw std::invalid_argument("a key consists of hexadecimal digits only");
    bytes[i / 2] = static_cast<std::uint8_t>(bytes[i / 2] << 4 | static_cast<unsigned>(digit));
  }
  return PairingKey(bytes);
}

std::string PairingKey::identity() const {
  const auto derived = derive(bytes_, "farhand pairing identity");
  return to_hex(std::span(derived).first(8));
}

std::string PairingKey::check_phrase() const {
  const auto derived = derive(bytes_, "farhand check phrase");
  std::string phrase;
  for (std::size_t i = 0; i < 8; i += 2) {
    phrase += (i > 0 ? " " : "") + speakable(static_cast<unsigned>(derived[i] << 8 | derived[i + 1]));
  }
  return phrase;
}

std::filesystem::path default_key_file() {
  const auto from = [](const char* variable) {
    const char* value = std::getenv(variable);
    return std::filesystem::path(value != nullptr ? value : "");
  };
  if (const auto config = from("XDG_CONFIG_HOME"); config.is_absolute()) return config / "farhand/key";
  if (const auto home = from("HOME"); home.is_absolute()) return home / ".config/farhand/key";
  return {};
}

PairingKey load_key(const std::filesystem::path& file) {
  const File in(file, O_RDONLY);
  require_open(file, in);
  require_private(file, in.fd());
  std::array<char, 2 * PairingKey::kBytes + 64> text{};
  std::size_t size = 0;
  ssize_t got = 0;
  while (size < text.size() && (got = ::read(in.fd(), text.data() + size, text.size() - size)) > 0) {
    size += static_cast<std::size_t>(got);
  }
  std::string problem;
  PairingKey::Bytes bytes{};
  try {
    bytes = PairingKey::from_text({text.data(), size}).bytes();
  } catch (const std::invalid_argument& error) {
    problem = error.what();
  }
  OPENSSL_cleanse(text.data(), text.size());
  if (!problem.empty()) refuse(file, problem);
  const PairingKey key(bytes);
  OPENSSL_cleanse(bytes.data(), bytes.size());
  return key;
}

void store_key(const std::filesystem::path& file, const PairingKey& key, ExistingKey existing) {
  make_directories(std::filesystem::absolute(file).parent_path());
  if (existing == ExistingKey::kRefuse && ::access(file.c_str(), F_OK) == 0) refuse(file, "exists already");
  std::string text = to_hex(key.bytes()) + "\n";
  NewFile part(file.string() + ".new");
  try {
    write_whole(file, part.descriptor(), text);
    part.complete();
  } catch (...) {
    part.discard();
    OPENSSL_cleanse(text.data(), text.size());
    throw;
  }
  OPENSSL_cleanse(text.data(), text.size());
  const char* made = part.file().c_str();
  // link() does not replace what another process has put there meanwhile; rename() does.
  const int result = existing == ExistingKey::kRefuse ? ::link(made, file.c_str()) : ::rename(made, file.c_str());
  const int why = errno;
  if (existing == ExistingKey::kRefuse || result != 0) ::unlink(made);
  if (result != 0) refuse(file, std::strerror(why));
}

void revoke_key(const std::filesystem::path& file) {
  load_key(file);
  const File out(file, O_WRONLY);
  require_open(file, out);
  write_whole(file, out.fd(), std::string(2 * PairingKey::kBytes + 1, '0'));
  if (::unlink(file.c_str()) != 0) refuse(file, std::strerror(errno));
}

std::string fingerprint(std::string_view text) {
  std::array<std::uint8_t, 32> hash{};
  if (EVP_Digest(text.data(), text.size(), hash.data(), nullptr, EVP_sha256(), nullptr) != 1) {
    throw std::runtime_error("OpenSSL cannot compute SHA-256");
  }
  return to_hex(hash);
}

}  // namespace farhand
