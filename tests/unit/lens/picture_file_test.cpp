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

TEST_F(PictureFile, AnotherSizeThanTheGelFilesIsRefused) {
  ASSERT_TRUE(writePicture(path("a.png"), cv::Mat(30, 40, CV_8UC1, cv::Scalar(7))));
  EXPECT_TRUE(readPicture(path("a.png"), {40, 30}));
  EXPECT_EQ(readPicture(path("a.png"), {30, 40}).error().what, "has 40 x 30 px, the gel file's camera 30 x 40");
}

TEST_F(PictureFile, WhatIsNoPictureIsSaid) {
  write(path("a.png"), "not a picture");
  EXPECT_TRUE(readPicture(path("a.png")).error().what.starts_with("is no PNG, TIFF or JPEG picture"));
  write(path("b.png"), "");
  EXPECT_EQ(readPicture(path("b.png")).error().what, "is empty");
  const auto absent = readPicture(path("c.png"));
  ASSERT_FALSE(absent);
  EXPECT_EQ(absent.error().exitCode, EX_NOINPUT);
  EXPECT_EQ(absent.error().what, "cannot be read: No such file or directory");
}

}  // namespace
}  // namespace lens::picture_file_test
