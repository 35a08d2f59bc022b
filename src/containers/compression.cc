#include "containers/compression.h"

#include <bzlib.h>
#include <lz4frame.h>
#include <zstd.h>

#include <algorithm>
#include <functional>
#include <memory>

namespace bslam::containers {
namespace {

constexpr std::size_t kFirstStep = std::size_t{1} << 16;

// Moves `in` and `out` past what was read and written. Returns false at the end of the stream or at an error.
using Step = std::function<bool(std::string_view& in, char* out, std::size_t capacity, std::size_t& written)>;

std::string run(std::string_view in, std::size_t max_bytes, const Step& step) {
  std::string out;
  std::size_t size = 0;
  for (bool more = true; more && size < max_bytes;) {
    if (size == out.size()) out.resize(std::min(max_bytes, std::max(kFirstStep, 2 * out.size())));
    const std::size_t left = in.size();
    std::size_t written = 0;
    more = step(in, out.data() + size, out.size() - size, written);
    size += written;
    if (written == 0 && in.size() == left) break;  // the input is truncated
  }
  out.resize(size);
  return out;
}

std::string bz2(std::string_view bytes, std::size_t max_bytes) {
  bz_stream stream{};
  if (BZ2_bzDecompressInit(&stream, 0, 0) != BZ_OK) return {};
  const std::unique_ptr<bz_stream, int (*)(bz_stream*)> release(&stream, BZ2_bzDecompressEnd);
  return run(bytes, max_bytes, [&](std::string_view& in, char* out, std::size_t capacity, std::size_t& written) {
    constexpr std::size_t kMost = std::size_t{1} << 30;  // its counts have 32 bits
    const std::size_t offered = std::min(in.size(), kMost), room = std::min(capacity, kMost);
    stream.next_in = const_cast<char*>(in.data());
    stream.avail_in = static_cast<unsigned>(offered);
    stream.next_out = out;
    stream.avail_out = static_cast<unsigned>(room);
    const int status = BZ2_bzDecompress(&stream);
    in.remove_prefix(offered - stream.avail_in);
    written = room - stream.avail_out;
    return status == BZ_OK;
  });
}

std::string lz4(std::string_view bytes, std::size_t max_bytes) {
  LZ4F_dctx* context = nullptr;
  if (LZ4F_isError(LZ4F_createDecompressionContext(&context, LZ4F_VERSION))) return {};
  const std::unique_ptr<LZ4F_dctx, LZ4F_errorCode_t (*)(LZ4F_dctx*)> release(context, LZ4F_freeDecompressionContext);
  return run(bytes, max_bytes, [&](std::string_view& in, char* out, std::size_t capacity, std::size_t& written) {
    std::size_t consumed = in.size();
    written = capacity;
    const std::size_t status = LZ4F_decompress(context, out, &written, in.data(), &consumed, nullptr);
    if (LZ4F_isError(status)) return written = 0, false;
    in.remove_prefix(consumed);
    return status != 0;
  });
}

std::string zstd(std::string_view bytes, std::size_t max_bytes) {
  const std::unique_ptr<ZSTD_DStream, std::size_t (*)(ZSTD_DStream*)> stream(ZSTD_createDStream(), ZSTD_freeDStream);
  if (!stream) return {};
  return run(bytes, max_bytes, [&](std::string_view& in, char* out, std::size_t capacity, std::size_t& written) {
    ZSTD_inBuffer from{in.data(), in.size(), 0};
    ZSTD_outBuffer to{out, capacity, 0};
    const std::size_t status = ZSTD_decompressStream(stream.get(), &to, &from);
    in.remove_prefix(from.pos);
    written = to.pos;
    return !ZSTD_isError(status) && (status != 0 || !in.empty());
  });
}

}  // namespace

std::optional<Compression> compression_named(std::string_view name) {
  if (name.empty() || name == "none") return Compression::kNone;
  if (name == "bz2") return Compression::kBz2;
  if (name == "lz4") return Compression::kLz4;
  if (name == "zstd") return Compression::kZstd;
  return std::nullopt;
}

std::string decompress(Compression compression, std::string_view bytes, std::size_t max_bytes) {
  switch (compression) {
    case Compression::kNone:
      return std::string(bytes.substr(0, max_bytes));
    case Compression::kBz2:
      return bz2(bytes, max_bytes);
    case Compression::kLz4:
      return lz4(bytes, max_bytes);
    case Compression::kZstd:
      return zstd(bytes, max_bytes);
  }
  return {};
}

}  // namespace bslam::containers
