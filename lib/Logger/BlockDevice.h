/// What the log asks of a card: whole sectors, handed over only when it is not busy.
///
/// A BlockDevice is a class with the members below; the Teensy fulfils it with SdFat on a
/// preallocated contiguous file, the host with an ordinary file or a fake card in a test.
///
///   bool busy();                                      true while the card cannot take a sector
///   bool writeSector(uint32_t index, const uint8_t (&data)[kSectorSize]);
///                                                     index counts from the start of the file; the
///                                                     last, partial one is written again as it
///                                                     fills. `data` stays valid and unchanged
///                                                     until busy() is false again, for a card that
///                                                     reads by DMA. False: the card failed.
///   bool sync(uint32_t length);                       makes the first `length` bytes durable and
///                                                     the file's size, which it is when busy() is
///                                                     false again. False: the card failed.
/// None of them waits.
#pragma once

#include <cstddef>
#include <cstdint>

namespace strix {

constexpr std::size_t kSectorSize = 512;

}  // namespace strix
