// SPDX-License-Identifier: Apache-2.0
#include "core/formats/exr.h"

#include <OpenEXR/ImfChannelList.h>
#include <OpenEXR/ImfFrameBuffer.h>
#include <OpenEXR/ImfHeader.h>
#include <OpenEXR/ImfInputPart.h>
#include <OpenEXR/ImfMultiPartInputFile.h>
#include <fmt/format.h>

#include "core/error.h"

namespace polarscan {
namespace {

constexpr int kLargestExrSide = 1 << 16;
constexpr std::uint64_t kMostExrInflated = 8800;  // values out of one byte: as for other pictures

// What `read` makes of the opened file; what the library throws as an Error.
template <class F>
auto WithExr(const std::filesystem::path& path, F&& read) {
  try {
    Imf::MultiPartInputFile file(path.c_str(), 0);
    return read(file);
  } catch (const Error&) {
    throw;
  } catch (const std::exception& problem) {
    throw Error(fmt::format("the EXR file cannot be read ({})", problem.what()), path.string(),
                "Copy the file again from where it came, or remove it");
  }
}

}  // namespace

std::vector<std::string> ExrChannels(const std::filesystem::path& path) {
  return WithExr(path, [](Imf::MultiPartInputFile& file) {
    std::vector<std::string> names;
    const Imf::ChannelList& channels = file.header(0).channels();
    for (auto channel = channels.begin(); channel != channels.end(); ++channel)
      names.emplace_back(channel.name());
    return names;
  });
}

std::vector<Image<float>> ReadExrChannels(const std::filesystem::path& path,
                                          const std::vector<std::string>& names) {
  return WithExr(path, [&](Imf::MultiPartInputFile& file) {
    const Imf::Header& header = file.header(0);
    const Imath::Box2i box = header.dataWindow();
    const std::int64_t width = std::int64_t(box.max.x) - box.min.x + 1,
                       height = std::int64_t(box.max.y) - box.min.y + 1;
    if (width < 1 || height < 1 || width > kLargestExrSide || height > kLargestExrSide ||
        std::uint64_t(width * height) > kMostExrInflated * std::filesystem::file_size(path))
      throw Error("the picture file promises more pixels than it can hold", path.string());
    std::vector<Image<float>> planes(names.size(), Image<float>(int(width), int(height)));
    Imf::FrameBuffer buffer;
    for (std::size_t i = 0; i < names.size(); ++i) {
      const Imf::Channel* channel = header.channels().findChannel(names[i].c_str());
      if (!channel || channel->xSampling != 1 || channel->ySampling != 1)
        throw Error(fmt::format("there is no channel {} of full size", names[i]), path.string());
      buffer.insert(names[i], Imf::Slice::Make(Imf::FLOAT, planes[i].row(0), box, sizeof(float),
                                               sizeof(float) * std::size_t(width)));
    }
    Imf::InputPart part(file, 0);
    part.setFrameBuffer(buffer);
    part.readPixels(box.min.y, box.max.y);
    return planes;
  });
}

}  // namespace polarscan
