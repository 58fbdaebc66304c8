// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <string>

#include "apps/command.h"

namespace polarscan {

// `polarscan check` of a session: what was lost, and where its clock jumped. repair: cuts off what was not
// finished and closes it.
void CheckSession(const std::string& folder, bool repair, Context& context);

}  // namespace polarscan
