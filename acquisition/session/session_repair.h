// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "acquisition/session/session_reader.h"

namespace polarscan {

// Cuts the unfinished tail of a session that was not closed off, and closes it with the counts that were
// found. Damaged records stay where they are; what can be read around them can be read after as well.
void RepairSession(Session& session);

}  // namespace polarscan
