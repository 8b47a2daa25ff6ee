#include "lens/picture_file.h"
#include "tests/support/seed.h"
#include "tests/unit/lens/workplace.h"

#include <opencv2/imgcodecs.hpp>

#include <cstdint>
#include <random>
#include <string>
#include <vector>

namespace lens::picture_file_test {
namespace {

using PictureFile = Workplace;

cv::Mat randomPicture(std::mt19937& generator, int type) {
  std::uniform_int_distribution<int> side(1, 60);
  cv::Mat picture(side(generator), side(generator), type);
  cv::theRNG().state = generator();
  cv::randu(picture, cv::Scalar::all(0), cv::Scalar::all(256));
  return picture;
}

bool isSame(const cv::Mat& a, const cv::Mat& b) {
  return a.size() == b.size() && a.type() == b.type() && cv::norm(a, b, cv::NORM_INF) == 0.0;
}

TEST_F(PictureFile, WhatIsWrittenIsRead) {
  std::mt19937 generator(tractiond::test::seed());
  for (int trial = 0; trial < 20; ++trial) {
    const cv::Mat picture = randomPicture(generator, trial % 2 == 0 ? CV_8UC1 : CV_8UC3);
    ASSERT_TRUE(writePicture(path("a.png"), picture));
    const auto read = readPicture(path("a.png"));
    ASSERT_TRUE(read) << read.error().message();
    EXPECT_TRUE(isSame(*read, picture));
    cv::imwrite(path("a.tiff"), picture);
    const auto tiff = readPicture(path("a.tiff"));
    ASSERT_TRUE(tiff) << tiff.error().message();
    EXPECT_TRUE(isSame(*tiff, picture));
  }
}

TEST_F(PictureFile, MoreBitsAreScaled) {
  cv::Mat picture(8, 8, CV_16UC1, cv::Scalar(1024));
  picture.at<std::uint16_t>(3, 4) = 4080;  // twelve bits, as cameras send them
  cv::imwrite(path("a.tiff"), picture);
  const auto read = readPicture(path("a.tiff"));
  ASSERT_TRUE(read);
  EXPECT_EQ(read->type(), CV_8UC1);
  EXPECT_EQ(read->at<std::uint8_t>(3, 4), 255);
  EXPECT_EQ(read->at<std::uint8_t>(0, 0), 64);
}

/// Every byte of a PNG is under a check sum: no damage goes unnoticed, and none is the end of the program.
TEST_F(PictureFile, EveryDamageOfAPngIsNamed) {
  std::mt19937 generator(tractiond::test::seed());
  for (int trial = 0; trial < 300; ++trial) {
    std::vector<std::uint8_t> bytes;
    cv::imencode(".png", randomPicture(generator, trial % 2 == 0 ? CV_8UC1 : CV_8UC3), bytes);
    std::string text(bytes.begin(), bytes.end());
    std::uniform_int_distribution<std::size_t> anywhere(0, text.size() - 1);
    if (trial % 3 == 0) {
      text.resize(anywhere(generator));
    } else {
      const std::size_t at = anywhere(generator);
      text[at] = static_cast<char>(text[at] ^ (1 << std::uniform_int_distribution<int>(0, 7)(generator)));
    }
    write(path("a.png"), text);
    const auto read = readPicture(path("a.png"));
    ASSERT_FALSE(read) << "trial " << trial;
    EXPECT_EQ(read.error().exitCode, EX_DATAERR);
    EXPECT_EQ(read.error().where, path("a.png"));
  }
}

/// TIFF and JPEG have no check sums: a damage may pass, but a cut never does.
TEST_F(PictureFile, EveryCutOfATiffOrJpegIsNamed) {
  std::mt19937 generator(tractiond::test::seed());
  for (int trial = 0; trial < 200; ++trial) {
    std::vector<std::uint8_t> bytes;
    cv::imencode(trial % 2 == 0 ? ".tiff" : ".jpg", randomPicture(generator, CV_8UC3), bytes);
    std::string text(bytes.begin(), bytes.end());
    const std::size_t kept = std::uniform_int_distribution<std::size_t>(0, text.size() - 1)(generator);
    write(path("a"), text.substr(0, kept));
    EXPECT_FALSE(readPicture(path("a"))) << "trial " << trial << ": " << kept << " of " << text.size() << " bytes";
    for (int i = 0; i < 5; ++i) {
      const std::size_t at = std::uniform_int_distribution<std::size_t>(0, text.size() - 1)(generator);
      text[at] = static_cast<char>(generator());
    }
    write(path("a"), text);
    (void)readPicture(path("a"));  // must come back
  }
}

/// A file of some bytes may say any size; its header is believed before memory is taken. Bytes are those of the
/// formats' specifications.
TEST_F(PictureFile, ASizeThatIsTooLargeIsRefusedByTheHeaderAlone) {
  const auto number = [](std::uint64_t value, int size, bool big) {
    std::string bytes;
    for (int i = 0; i < size; ++i) bytes += static_cast<char>(value >> (8 * (big ? size - 1 - i : i)));
    return bytes;
  };
  const auto png = [&](std::uint32_t width, std::uint32_t height, int bits, int colour) {
    const std::string chunk = "IHDR" + number(width, 4, true) + number(height, 4, true) + static_cast<char>(bits) +
                              static_cast<char>(colour) + std::string(3, '\0');
    return "\x89PNG\r\n\x1a\n" + number(13, 4, true) + chunk + std::string(4, '\0');
  };
  const auto jpeg = [&](int width, int height) {  // an application's segment first, with what looks like a frame in it
    return "\xff\xd8\xff\xe1" + number(10, 2, true) + "\xff\xc0" + number(17, 2, true) + std::string(4, '\1') +
           "\xff\xff\xc2" + number(17, 2, true) + '\x08' + number(height, 2, true) + number(width, 2, true) + '\x03' +
           std::string(9, '\1') + "\xff\xd9";
  };
  const auto tiff = [&](bool big, std::uint32_t width, std::uint32_t height, std::uint32_t tile) {
    std::string file =
        (big ? std::string("MM\0*", 4) : std::string("II*\0", 4)) + number(8, 4, big) + number(6, 2, big);
    const auto entry = [&](int tag, int type, std::uint32_t count, std::uint32_t value) {
      file += number(tag, 2, big) + number(type, 2, big) + number(count, 4, big);
      file += type == 3 && count == 1 ? number(value, 2, big) + std::string(2, '\0') : number(value, 4, big);
    };
    entry(256, 4, 1, width);
    entry(257, 4, 1, height);
    entry(258, 3, 3, 8 + 2 + 6 * 12 + 4);  // elsewhere: three numbers
    entry(277, 3, 1, 3);
    entry(322, 4, 1, tile);
    entry(323, 4, 1, tile);
    return file + std::string(4, '\0') + number(16, 2, big) + number(16, 2, big) + number(16, 2, big);
  };
  const auto refused = [&](const std::string& bytes, const std::string& what) {
    write(path("a"), bytes);
    const auto read = readPicture(path("a"));
    ASSERT_FALSE(read);
    EXPECT_EQ(read.error().what.substr(0, what.size()), what);
  };
  refused(png(16384, 16384, 16, 2), "would need 1536 MiB of memory, and at most 512 are used");
  refused(png(16385, 8, 8, 0), "is larger than 16384 px");
  refused(png(0xffffffff, 0xffffffff, 16, 6), "is larger than 16384 px");
  refused(jpeg(32000, 32000), "is larger than 16384 px");
  refused(jpeg(16384, 16384), "would need 768 MiB");
  for (const bool big : {true, false}) {
    refused(tiff(big, 40000, 100, 0), "is larger than 16384 px");
    refused(tiff(big, 16000, 16000, 0), "would need 1464 MiB");
    refused(tiff(big, 100, 100, 1 << 20), "would need 6291456 MiB");
  }
}

TEST_F(PictureFile, AnotherSizeThanTheGelFilesIsRefused) {
  ASSERT_TRUE(writePicture(path("a.png"), cv::Mat(30, 40, CV_8UC1, cv::Scalar(7))));
  EXPECT_TRUE(readPicture(path("a.png"), {40, 30}));
  EXPECT_EQ(readPicture(path("a.png"), {30, 40}).error().what, "has 40 x 30 px, the gel file's camera 30 x 40");
}

TEST_F(PictureFile, WhatIsNoPictureIsSaid) {
  write(path("a.png"), "not a picture");
  EXPECT_EQ(readPicture(path("a.png")).error().what, "is no PNG, TIFF or JPEG picture");
  write(path("b.png"), "");
  EXPECT_EQ(readPicture(path("b.png")).error().what, "is empty");
  const auto absent = readPicture(path("c.png"));
  ASSERT_FALSE(absent);
  EXPECT_EQ(absent.error().exitCode, EX_NOINPUT);
  EXPECT_EQ(absent.error().what, "cannot be read: No such file or directory");
}

}  // namespace
}  // namespace lens::picture_file_test
