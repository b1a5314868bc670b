// SPDX-License-Identifier: LGPL-2.1-or-later
// Where the server's pages begin: "" or, behind a proxy, the sub-path ("/silo").

export const root = new URL("..", import.meta.url).pathname.replace(/\/$/, "");
