// Where a character's skin meets: eyeballs, lips, lids, and what rides on them. Told from the rigid parts and the
// feature points; nothing is known of any particular head.
#pragma once

#include "rig/association.h"
#include "rig/contacts.h"
#include "rig/rig.h"

namespace volto::rig {

// `rig`: with its points, parts and operator. A head without eyeballs has no balls; a slit whose margins cannot be
// followed along the skin is left out.
Contacts findContacts(const Rig& rig, const Skin& skin, const SkinAssociation& association, const SkinPoints& on_skin);

}  // namespace volto::rig
