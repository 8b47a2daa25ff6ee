// Requests about a camera's features while it streams, and its answers: the messages themselves
// (proto/traction/v1/control.proto). Values are text, as GenICam writes them.
#pragma once

#include "traction/v1/control.pb.h"

namespace tractiond {

using CameraStep = traction::v1::CameraRequest;
using CameraFeature = traction::v1::CameraFeature;
using CameraReport = traction::v1::CameraReply;

}  // namespace tractiond
