// SPDX-License-Identifier: Apache-2.0
// Vectors as arrays of three numbers. First of the page's scripts, which are joined to one (apps/CMakeLists.txt).
"use strict";

const add = (a, b) => [a[0] + b[0], a[1] + b[1], a[2] + b[2]];
const sub = (a, b) => [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
const scale = (a, s) => [a[0] * s, a[1] * s, a[2] * s];
const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];

const length = (a) => Math.hypot(...a);
const unit = (a) => scale(a, 1 / (length(a) || 1));
const clamp = (x, low, high) => Math.min(high, Math.max(low, x));
