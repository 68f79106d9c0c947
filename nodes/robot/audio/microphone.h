#pragma once

#include <memory>

#include "nido/interfaces/audio.h"
#include "nido/interfaces/clock.h"
#include "nido/interfaces/result.h"

namespace nido {

// The computer's default microphone, one channel, through PortAudio. Keeps at most ten seconds that nobody
// takes. kNotFound when there is none. `clock` must outlive the device.
Result<std::unique_ptr<IAudioGrabberSound>> open_microphone(int sample_rate_hz, const IClock& clock);

}  // namespace nido
