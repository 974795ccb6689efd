// Contacts (rig/contacts.h) of one character that is posed again and again: what does not change from pose to pose is
// kept, and lies side by side, since live a network pushes all else out of the processor's cache between two poses.
#pragma once

#include <array>
#include <memory>
#include <span>

#include "rig/contacts.h"

namespace volto::rig {

// Thread-safe after construction. Borrows nothing.
class PreparedContacts {
 public:
  // `neutral`: #V, as for resolveContacts().
  PreparedContacts(const Contacts& contacts, std::span<const std::array<float, 3>> neutral);
  ~PreparedContacts();
  PreparedContacts(PreparedContacts&&) noexcept;
  PreparedContacts& operator=(PreparedContacts&&) noexcept;

  // The same as resolveContacts(), to the bit. Allocates nothing.
  void resolve(std::span<std::array<float, 3>> positions) const;

 private:
  struct State;
  std::unique_ptr<const State> state_;
};

}  // namespace volto::rig
