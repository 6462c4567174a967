// Values that outlive the power, and what becomes of them when it goes at the wrong moment.
#include <unity.h>

#include "Crc32.h"
#include "FakeStorage.h"
#include "suites.h"

using namespace strix;

namespace {

constexpr std::size_t kHalf = 2140;  // of a Teensy's 4284 bytes, in whole words

/// Storage that has seen the sets 1 and 2 saved, in this order.
Storage twiceSaved() {
  Storage storage;
  ParameterStore<Storage> store(storage);
  TEST_ASSERT_TRUE(save(store, setNumber(1), keyNumber(1)) == SaveState::Done);
  TEST_ASSERT_TRUE(save(store, setNumber(2), keyNumber(2)) == SaveState::Done);
  return storage;
}

/// Bytes that the last of two saves wrote.
std::size_t bytesOfASave() {
  Storage storage = twiceSaved();
  storage.written = 0;
  ParameterStore<Storage> store(storage);
  TEST_ASSERT_TRUE(save(store, setNumber(0), keyNumber(0)) == SaveState::Done);
  return storage.written;
}

template <class Value>
Value stored(const Storage& storage, std::size_t offset) {
  Value value;
  std::memcpy(&value, &storage.bytes.at(offset), sizeof value);
  return value;
}
template <class Value>
void store(Storage& storage, std::size_t offset, Value value) {
  std::memcpy(&storage.bytes.at(offset), &value, sizeof value);
}

/// Makes the CRC of a slot that was changed by hand right again: the layout as ParameterStore.h
/// describes it, told a second time.
void seal(Storage& storage, std::size_t slot) {
  const std::size_t size = 48 + 8U * stored<std::uint16_t>(storage, slot + 6);
  Crc32 crc;
  crc.update(&storage.bytes.at(slot + 4), 8);
  crc.update(&storage.bytes.at(slot + 16), size - 16);
  store(storage, slot + 12, crc.value());
}

void test_what_was_saved_is_there_after_the_next_start() {
  for (const std::uint8_t blank : std::array<std::uint8_t, 2>{0xFF, 0x00}) {
    Storage storage(blank);
    TEST_ASSERT_TRUE(start(storage).report.empty);
    TEST_ASSERT_TRUE(start(storage).hasDefaults());
    for (unsigned which = 0; which < 7; ++which) {
      ParameterStore<Storage> store(storage);  // as after a start
      Parameters parameters;
      SigningKey key;
      store.load(parameters, key);
      TEST_ASSERT_TRUE(save(store, setNumber(which), keyNumber(which)) == SaveState::Done);
      const Started s = start(storage);
      TEST_ASSERT_TRUE(s.has(which));
      TEST_ASSERT_FALSE(s.report.empty || s.report.damaged);
      TEST_ASSERT_EQUAL_UINT16(0, s.report.refused + s.report.unknown);
    }
  }
}

void test_power_that_goes_after_any_byte_leaves_the_old_set_or_the_new_one() {
  const std::size_t bytes = bytesOfASave();
  for (const bool fresh : {false, true}) {  // beside a set of before, or beside nothing
    for (std::size_t cut = 0; cut <= bytes; ++cut) {
      Storage storage = fresh ? Storage{} : twiceSaved();
      ParameterStore<Storage> store(storage);
      Parameters parameters;
      SigningKey key{};
      store.load(parameters, key);
      storage.powerFor = cut;
      (void)save(store, setNumber(0), keyNumber(0));
      const Started s = start(storage);
      const bool whole = cut == bytes;
      TEST_ASSERT_TRUE(whole ? s.has(0) : fresh ? s.hasDefaults() : s.has(2));
      TEST_ASSERT_EQUAL(!whole && cut != 0, s.report.damaged);
    }
  }
}

void test_a_save_that_was_cut_off_can_be_made_again() {
  for (std::size_t cut = 1; cut < bytesOfASave(); cut += 13) {
    Storage storage = twiceSaved();
    ParameterStore<Storage> first(storage);
    Parameters parameters;
    SigningKey key{};
    first.load(parameters, key);
    storage.powerFor = cut;
    TEST_ASSERT_TRUE(save(first, setNumber(0), keyNumber(0)) == SaveState::Failed);
    TEST_ASSERT_TRUE(start(storage).has(2));
    storage.powerFor = Storage::kForEver;
    TEST_ASSERT_TRUE(save(first, setNumber(0), keyNumber(0)) == SaveState::Done);
    TEST_ASSERT_TRUE(start(storage).has(0));
    TEST_ASSERT_FALSE(start(storage).report.damaged);
  }
}

void test_a_bit_that_flips_anywhere_costs_one_set_at_most() {
  const Storage good = twiceSaved();
  const std::size_t used = bytesOfASave() - 4;  // the magic is written twice
  for (std::size_t slot : {std::size_t{0}, kHalf}) {
    for (std::size_t bit = 0; bit < 8 * kHalf; ++bit) {
      Storage storage = good;
      storage.bytes.at(slot + bit / 8) ^= static_cast<std::uint8_t>(1U << bit % 8);
      const Started s = start(storage);
      const bool inside = bit / 8 < used;
      // The newest stands in the slot that the second save took.
      const bool newestHit = inside && start(storage).has(1);
      TEST_ASSERT_TRUE(s.has(newestHit ? 1 : 2));
      TEST_ASSERT_EQUAL(inside, s.report.damaged);
    }
  }
}

void test_one_slot_lost_whole_leaves_the_other_and_both_lost_the_defaults() {
  // As when the flash sector is being erased that holds it.
  for (const std::uint8_t rubbish : std::array<std::uint8_t, 3>{0xFF, 0x00, 0x5A}) {
    bool newestLost = false;
    for (std::size_t slot : {std::size_t{0}, kHalf}) {
      Storage storage = twiceSaved();
      std::fill_n(&storage.bytes.at(slot), kHalf, rubbish);
      const Started s = start(storage);
      TEST_ASSERT_TRUE(s.has(1) || s.has(2));
      newestLost = newestLost || s.has(1);
    }
    TEST_ASSERT_TRUE(newestLost);
    Storage storage = twiceSaved();
    storage.bytes.fill(rubbish);
    TEST_ASSERT_TRUE(start(storage).hasDefaults());
    TEST_ASSERT_EQUAL(rubbish == 0x5A, start(storage).report.damaged);
  }
}

void test_a_save_touches_only_the_slot_that_is_not_the_newest() {
  const Storage before = twiceSaved();
  Storage after = before;
  ParameterStore<Storage> store(after);
  Parameters parameters;
  SigningKey key{};
  store.load(parameters, key);
  TEST_ASSERT_TRUE(save(store, setNumber(0), keyNumber(0)) == SaveState::Done);
  const auto changed = [&](std::size_t from) {
    return std::memcmp(&before.bytes.at(from), &after.bytes.at(from), kHalf) != 0;
  };
  TEST_ASSERT_TRUE(changed(0) != changed(kHalf));
}

void test_the_sequence_wraps() {
  Storage storage = twiceSaved();
  // The newest slot gets the last number there is, the older the one before.
  const bool firstIsNewest = stored<std::uint32_t>(storage, 8) == 2;
  for (std::size_t slot : {std::size_t{0}, kHalf}) {
    const bool newest = (slot == 0) == firstIsNewest;
    store(storage, slot + 8, newest ? 0xFFFFFFFFU : 0xFFFFFFFEU);
    seal(storage, slot);
  }
  for (unsigned which = 2; which < 6; ++which) {
    TEST_ASSERT_TRUE(start(storage).has(which));
    ParameterStore<Storage> store(storage);
    Parameters parameters;
    SigningKey key{};
    store.load(parameters, key);
    TEST_ASSERT_TRUE(save(store, setNumber(which + 1), keyNumber(which + 1)) == SaveState::Done);
  }
  TEST_ASSERT_TRUE(start(storage).has(6));
}

/// The storage of firmware that knew only some of today's parameters, and one that is gone.
Storage ofOtherFirmware() {
  Storage storage;
  ParameterStore<Storage> store(storage);
  TEST_ASSERT_TRUE(save(store, setNumber(1), keyNumber(1)) == SaveState::Done);
  const std::size_t slot = stored<std::uint32_t>(storage, 0) == 0xFFFFFFFF ? kHalf : 0;
  // In reverse, without the last ten, and a name that today's table does not have.
  const std::size_t first = slot + 48;
  std::array<std::uint64_t, kParameterCount> entries{};
  std::memcpy(entries.data(), &storage.bytes.at(first), sizeof entries);
  constexpr std::size_t kKnown = kParameterCount - 10;
  for (std::size_t i = 0; i < kKnown; ++i) {
    ::store(storage, first + 8 * i, entries.at(kKnown - 1 - i));
  }
  ::store(storage, first + 8 * kKnown, nameHash("GONE_SINCE"));
  ::store(storage, first + 8 * kKnown + 4, 1.0F);
  ::store(storage, slot + 6, static_cast<std::uint16_t>(kKnown + 1));
  seal(storage, slot);
  return storage;
}

void test_values_of_other_firmware_go_to_their_names() {
  Storage storage = ofOtherFirmware();
  const Started s = start(storage);
  TEST_ASSERT_FALSE(s.report.damaged || s.report.empty);
  TEST_ASSERT_EQUAL_UINT16(1, s.report.unknown);
  TEST_ASSERT_TRUE(s.key == keyNumber(1));
  for (std::size_t i = 0; i < kParameterCount; ++i) {
    const bool known = i < kParameterCount - 10;
    TEST_ASSERT_EQUAL_FLOAT(getParameter(known ? setNumber(1) : Parameters{}, i),
                            getParameter(s.parameters, i));
  }
}

void test_a_slot_that_claims_more_than_it_can_hold_is_damaged() {
  Storage storage = twiceSaved();
  const std::size_t newest = stored<std::uint32_t>(storage, 8) == 2 ? 0 : kHalf;
  store(storage, newest + 6, std::uint16_t{0xFFFF});
  const Started s = start(storage);
  TEST_ASSERT_TRUE(s.has(1));
  TEST_ASSERT_TRUE(s.report.damaged);
}

void test_a_stored_value_that_the_table_does_not_allow_is_its_default_and_told() {
  Storage storage;
  ParameterStore<Storage> writer(storage);
  Parameters parameters = setNumber(1);
  parameters.fenceRadius = 1e9F;
  parameters.radioPitch = 2.5F;
  TEST_ASSERT_TRUE(save(writer, parameters, {}) == SaveState::Done);
  const Started s = start(storage);
  TEST_ASSERT_EQUAL_UINT16(2, s.report.refused);
  TEST_ASSERT_EQUAL_UINT16(findParameter("FENCE_RADIUS"), s.report.firstRefused);
  parameters.fenceRadius = Parameters{}.fenceRadius;
  parameters.radioPitch = Parameters{}.radioPitch;
  TEST_ASSERT_TRUE(same(s.parameters, parameters));
}

void test_a_step_writes_one_word_and_a_save_holds_the_values_of_its_beginning() {
  Storage storage;
  ParameterStore<Storage> store(storage);
  Parameters parameters = setNumber(1);
  TEST_ASSERT_NULL(store.save(parameters, keyNumber(1)));
  int steps = 0;
  for (; store.state() == SaveState::Saving; ++steps) {
    parameters = setNumber(2);  // changed meanwhile
    TEST_ASSERT_NOT_NULL(store.save(parameters, keyNumber(2)));
    store.step();
  }
  TEST_ASSERT_TRUE(store.state() == SaveState::Done);
  TEST_ASSERT_TRUE(start(storage).has(1));
  TEST_ASSERT_LESS_OR_EQUAL_size_t(4, storage.mostAtOnce);
  TEST_ASSERT_TRUE(save(store, parameters, keyNumber(2)) == SaveState::Done);  // the other slot
  TEST_ASSERT_TRUE(storage.inOneWord);    // of the Teensy's flash: one erasure at most
  TEST_ASSERT_LESS_THAN_INT(200, steps);  // 0.4 s where one fits between two control ticks
}

void test_storage_that_does_not_keep_what_is_written_is_told() {
  Storage storage = twiceSaved();
  ParameterStore<Storage> silent(storage);
  Parameters parameters;
  SigningKey key{};
  silent.load(parameters, key);
  storage.powerFor = 0;
  TEST_ASSERT_TRUE(save(silent, setNumber(0), keyNumber(0)) == SaveState::Failed);
  storage.powerFor = Storage::kForEver;
  storage.answers = false;
  TEST_ASSERT_TRUE(save(silent, setNumber(0), keyNumber(0)) == SaveState::Failed);
  TEST_ASSERT_TRUE(start(storage).has(2));
}

}  // namespace

void runStoreTests() {
  RUN_TEST(test_what_was_saved_is_there_after_the_next_start);
  RUN_TEST(test_power_that_goes_after_any_byte_leaves_the_old_set_or_the_new_one);
  RUN_TEST(test_a_save_that_was_cut_off_can_be_made_again);
  RUN_TEST(test_a_bit_that_flips_anywhere_costs_one_set_at_most);
  RUN_TEST(test_one_slot_lost_whole_leaves_the_other_and_both_lost_the_defaults);
  RUN_TEST(test_a_save_touches_only_the_slot_that_is_not_the_newest);
  RUN_TEST(test_the_sequence_wraps);
  RUN_TEST(test_values_of_other_firmware_go_to_their_names);
  RUN_TEST(test_a_slot_that_claims_more_than_it_can_hold_is_damaged);
  RUN_TEST(test_a_stored_value_that_the_table_does_not_allow_is_its_default_and_told);
  RUN_TEST(test_a_step_writes_one_word_and_a_save_holds_the_values_of_its_beginning);
  RUN_TEST(test_storage_that_does_not_keep_what_is_written_is_told);
}
