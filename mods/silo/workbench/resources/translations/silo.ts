<?xml version="1.0" encoding="utf-8"?>
<!DOCTYPE TS>
<TS version="2.1" sourcelanguage="en">
    <context>
        <name>Silo</name>
        <message>
            <location filename="../../activity/box.py" />
            <location filename="../../colleagues/theirs.py" />
            <source>… and {n} more line</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../activity/box.py" />
            <source>… and {n} more lines; the preview shows all</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../activity/events.py" />
            <source>The server no longer has the events since then. See its own activity page.</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../activity/events.py" />
            <source>Some activity may be missing</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../activity/events.py" />
            <source>Revision {n} of {number}</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../activity/events.py" />
            <source>New item: {number}</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../activity/events.py" />
            <source>Archived: {number}</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../activity/feed.py" />
            <source>{n} items committed</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../activity/feed.py" />
            <source>{n} new items</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../activity/feed.py" />
            <source>{n} new revisions</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../activity/links.py" />
            <location filename="../../preview/dialog.py" />
            <source>View in Silo →</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../activity/sent.py" />
            <source>BOM not synced: {number}</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../activity/sent.py" />
            <source>Committed: {number}</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../activity/sent.py" />
            <source>BOM unchanged</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../activity/sent.py" />
            <source>Revision {n} uploaded</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../activity/sent.py" />
            <source>The file is in Silo already</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../activity/sent.py" />
            <source>{n} item in the Silo BOM is not referenced by components in this assembly.</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../activity/sent.py" />
            <source>{n} items in the Silo BOM are not referenced by components in this assembly.</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../activity/sent.py" />
            <source>Incomplete: {n} component is missing; its known line stays as it is.</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../activity/sent.py" />
            <source>Incomplete: {n} components are missing; their known lines stay as they are.</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../activity/sent.py" />
            <source>The file is in Silo. The BOM waits until these are mended:</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../activity/sent.py" />
            <source>Sync without it</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../activity/sent.py" />
            <source>Sync without them</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../activity/sent.py" />
            <location filename="../../pane/waiting.py" />
            <source>Relink…</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../activity/sent.py" />
            <source>Show all…</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../activity/sent.py" />
            <source>Open in {bom}</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../activity/sent.py" />
            <location filename="../../pane/waiting.py" />
            <source>Same part</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../activity/sent.py" />
            <location filename="../../pane/waiting.py" />
            <source>New part…</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../activity/sent.py" />
            <location filename="../../pane/waiting.py" />
            <location filename="../../preview/dialog.py" />
            <source>Show</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../activity/sent.py" />
            <source>{number}: the assembly has {cad}, a manual line in Silo says {silo}</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../activity/sent.py" />
            <location filename="../../commit/flow.py" />
            <location filename="../../preview/dialog.py" />
            <source>Register Parts…</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../activity/team.py" />
            <source>A file that is saved here may hold objects that the FreeCAD of your colleagues does not know and does not load.</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../activity/team.py" />
            <source>Files of your colleagues may hold objects that this FreeCAD does not know. You are asked before a save removes such objects from a file.</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../activity/team.py" />
            <source>Your team works with FreeCAD {team}; this is {here}</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../addon.py" />
            <source>Looking at the server</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../addon.py" />
            <source>Save over it</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../addon.py" />
            <source>Keep the newer file</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../addon.py" />
            <source>History</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../addon.py" />
            <source>{name} has no Silo part number yet. Register it first.</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../buttons.py" />
            <source>Save a copy</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../buttons.py" />
            <source>This document is not open any more.</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../buttons.py" />
            <source>[Silo] This document is not open: </source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../buttons.py" />
            <source>[Silo] Not opened, for it is not on the Silo server in use: </source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../buttons.py" />
            <source>No browser could be opened. The address was copied.</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../buttons.py" />
            <source>[Silo] No browser could be opened; the address was copied: </source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../buttons.py" />
            <source>[Silo] These objects are not in the document any more.</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../buttons.py" />
            <source>[Silo] The first {n} of {all} objects are selected.</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../colleagues/states.py" />
            <location filename="../../freecad/silo_group.py" />
            <source>in Silo</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../colleagues/states.py" />
            <source>not in Silo</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../colleagues/states.py" />
            <source>edited since its commit</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../colleagues/states.py" />
            <source>newer in Silo</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../colleagues/states.py" />
            <source>edited, and newer in Silo</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../colleagues/states.py" />
            <source>waits to be sent</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../colleagues/states.py" />
            <location filename="../../../outbox/status_text.py" />
            <source>held for your choice</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../colleagues/states.py" />
            <source>the server was restored from a backup: it has an older one</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../colleagues/states.py" />
            <source>its item is not on this server</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../colleagues/theirs.py" />
            <source>leave out</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../colleagues/theirs.py" />
            <source>open theirs beside mine</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../colleagues/theirs.py" />
            <source>take theirs</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../colleagues/theirs.py" />
            <source>commit mine on top</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../colleagues/theirs.py" />
            <source>the file on disk was changed since you opened it</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../colleagues/theirs.py" />
            <source>a file that is no revision in Silo</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../colleagues/theirs.py" />
            <source>revision {n}</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../colleagues/theirs.py" />
            <location filename="../../commit/dialog.py" />
            <location filename="../../pane/banner.py" />
            <source>Somebody</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../colleagues/theirs.py" />
            <source>{who} committed revision {n}; yours was made from {base}</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../colleagues/theirs.py" />
            <source>{name}: {theirs} in theirs, {mine} in yours</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../colleagues/theirs.py" />
            <source>{name}: {base} → {mine} by both of you</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../colleagues/theirs.py" />
            <source>{name}: {base} → {theirs} by them, {mine} by you</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../colleagues/theirs.py" />
            <source>{name}: {base} → {theirs} by them, as before in yours</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../colleagues/theirs.py" />
            <source>{name}: {base} → {mine} by you, as before in theirs</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../colleagues/theirs.py" />
            <source>… and {n} more lines</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../commit/below.py" />
            <source>Not all files below it are in Silo: {name}</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../commit/below.py" />
            <source>{n} file of it is in Silo as it is here: {name}</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../commit/below.py" />
            <source>{n} files of it are in Silo as they are here: {name}</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../commit/below.py" />
            <source>{n} file of it waits to be sent: {name}</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../commit/below.py" />
            <source>{n} files of it wait to be sent: {name}</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../commit/below.py" />
            <location filename="../../revisions/project.py" />
            <source>its BOM is held: {why}</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../commit/below.py" />
            <source>sent</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../commit/below.py" />
            <source>the same</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../commit/dialog.py" />
            <location filename="../../commit/flow.py" />
            <source>Commit to Silo</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../commit/dialog.py" />
            <source>What changed?</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../commit/dialog.py" />
            <source>A comment for this revision (may stay empty)</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../commit/dialog.py" />
            <source>Register it in Silo as well: it has no part number yet</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../commit/dialog.py" />
            <source>Looking for what colleagues committed since…</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../commit/dialog.py" />
            <source>This file will be committed:</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../commit/dialog.py" />
            <source>This file will be committed after {n} file below it with unsaved edits:</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../commit/dialog.py" />
            <source>This file will be committed after {n} files below it with unsaved edits, the lowest first:</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../commit/dialog.py" />
            <source>{n} more file was only recomputed; check it to commit it anyway.</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../commit/dialog.py" />
            <source>{n} more files were only recomputed; check them to commit them anyway.</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../commit/dialog.py" />
            <location filename="../../revisions/dialog.py" />
            <source>File</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../commit/dialog.py" />
            <location filename="../../revisions/dialog.py" />
            <source>State</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../commit/dialog.py" />
            <source>Select:</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../commit/dialog.py" />
            <source>edited</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../commit/dialog.py" />
            <source>all</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../commit/dialog.py" />
            <source>none</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../commit/dialog.py" />
            <source>only this file</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../commit/dialog.py" />
            <location filename="../../settings/page.py" />
            <source>Commit</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../commit/dialog.py" />
            <source>Ctrl+Return</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../commit/dialog.py" />
            <source>Cancel</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../commit/dialog.py" />
            <source>Files that somebody else has changed are left out, unless you choose otherwise:</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../commit/dialog.py" />
            <source>(no comment)</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../commit/dialog.py" />
            <source>Commit to Silo – {who} committed since you opened</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../commit/dialog.py" />
            <source>Commit to Silo – changed on disk since you opened</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../commit/dialog.py" />
            <source>Do it</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../commit/flow.py" />
            <source>Looking at the linked files</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../commit/flow.py" />
            <source>Looking at what Silo has now</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../commit/flow.py" />
            <location filename="../../session/session.py" />
            <source>Looking for colleagues' commits</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../commit/flow.py" />
            <source>Its BOM was not synced: it changed after its commit. Commit it again.</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../commit/flow.py" />
            <source>Not committed: {name}</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../commit/flow.py" />
            <source>No Silo server is set up: the files are saved, and wait to be sent.</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../commit/flow.py" />
            <source>There is no connection now: the files are saved, and sent later.</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../commit/flow.py" />
            <source>It has no Silo part number yet, so it was not sent.</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../commit/flow.py" />
            <source>Saved, but not in Silo: {name}</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../commit/plan.py" />
            <source>another program changed the file since it was opened: reload it, or commit yours over it</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../commit/plan.py" />
            <source>unsaved edits: will be saved</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../commit/plan.py" />
            <source>recomputed only: nothing differs from the file</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../commit/plan.py" />
            <source>saved already</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../commit/plan.py" />
            <source>has no file yet: save it under a name first</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../commit/plan.py" />
            <source>FreeCAD has loaded it only in part and cannot save these edits: open the file itself and make them there</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../commit/plan.py" />
            <source>the file is read-only: these edits are not saved</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../commit/plan.py" />
            <source>made by a newer FreeCAD: saving it here would destroy {lost}, so it is not saved. Make these edits in the newer FreeCAD</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../commit/plan.py" />
            <source>the file is damaged, and FreeCAD has opened what it could read of it: fetch the file again, or check that nothing is missing and save it in FreeCAD yourself</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../commit/plan.py" />
            <source>{name} has no file yet. Save it under a name first.</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../commit/take.py" />
            <source>It was closed before it was saved: open it and commit it again.</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../documents/snapshot.py" />
            <source>Make the right assembly active: double-click it in the tree.</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../freecad/loss_guard.py" />
            <source>This FreeCAD {here} does not know these objects, nor load them: {lost}.</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../freecad/loss_guard.py" />
            <source>Saving the file here would remove them from it: change it there.</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../freecad/loss_guard.py" />
            <source>{name} was saved by FreeCAD {there}. This FreeCAD {here} does not know, and would remove from the file: {lost}.</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../freecad/loss_guard.py" />
            <source>Newer file</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../freecad/loss_guard.py" />
            <source>Saved over the newer file, without {lost}.</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../freecad/loss_guard.py" />
            <source>The newer file is kept for {n} days at {path}</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../freecad/loss_guard.py" />
            <source>What you saved is kept for {n} days at {path}</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../freecad/loss_guard.py" />
            <source>The newer file was kept.</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../freecad/loss_guard.py" />
            <source>Made by a newer FreeCAD: {name}</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../freecad/silo_group.py" />
            <source>not registered: left out of the BOM</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../freecad/silo_group.py" />
            <source>Part number in Silo</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../freecad/silo_group.py" />
            <source>Silo's data of this component</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../gui/closing.py" />
            <location filename="../../settings/page.py" />
            <location filename="../../start.py" />
            <source>Silo</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../gui/closing.py" />
            <source>Your commits are being copied to the outbox. They are sent when FreeCAD is started the next time.
Commits that are not copied by then may have to be committed again.</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../gui/closing.py" />
            <source>Close without waiting</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../gui/widgets.py" />
            <location filename="../../mass/dialog.py" />
            <location filename="../../preview/dialog.py" />
            <location filename="../../register/dialog.py" />
            <location filename="../../revisions/dialog.py" />
            <location filename="../../settings/install.py" />
            <source>Close</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../mass/dialog.py" />
            <source>Mass of {name}</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../mass/dialog.py" />
            <source>Copy the table, for a spreadsheet</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../mass/dialog.py" />
            <source>Copy</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../mass/dialog.py" />
            <location filename="../../register/rows.py" />
            <source>Part</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../mass/dialog.py" />
            <source>Quantity</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../mass/dialog.py" />
            <source>Mass of one</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../mass/dialog.py" />
            <source>Mass</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../mass/dialog.py" />
            <source>Volume of one, cm³</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../mass/dialog.py" />
            <source>Material</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../mass/dialog.py" />
            <location filename="../../register/dialog.py" />
            <source>Remarks</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../mass/flow.py" />
            <source>Mass of the assembly</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../mass/flow.py" />
            <source>This FreeCAD's Python has no numpy, which masses need.</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../mass/rows.py" />
            <source>1 part has no mass; it is missing from the sum.</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../mass/rows.py" />
            <source>{n} parts have no mass; they are missing from the sum.</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../mass/rows.py" />
            <source>No part of this assembly has a material with a density.</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../mass/rows.py" />
            <source>{mass} in {pieces}, centre of mass at {x}, {y}, {z} mm</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../mass/rows.py" />
            <source>1 piece</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../mass/rows.py" />
            <source>{n} pieces</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../mass/rows.py" />
            <source>no material with a density</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../mass/waiting.py" />
            <source>Measuring {name}</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../mass/waiting.py" />
            <source>Reading the assembly…</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../mass/waiting.py" />
            <source>Part {n} of {total}</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../mass/waiting.py" />
            <source>face {n} of {total}</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../packages.py" />
            <source>Silo needs the Python packages {names}. Install them with silo-mod install-addon, or with: {command} – then start FreeCAD again.</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../pane/banner.py" />
            <source>{who} committed {name} (revision {n}) since you opened it.</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../pane/banner.py" />
            <location filename="../../pane/boxes.py" />
            <location filename="../../preview/flow.py" />
            <source>… and {n} more</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../pane/banner.py" />
            <source>Settings…</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../pane/banner.py" />
            <location filename="../../settings/install.py" />
            <source>Try again</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../pane/banner.py" />
            <location filename="../../settings/install.py" />
            <source>Install What Silo Needs…</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../pane/banner.py" />
            <source>No Silo server is set up yet.</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../pane/banner.py" />
            <source>Connected to {host}</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../pane/banner.py" />
            <source>{host} is read-only now. Commits wait here until it takes changes again.</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../pane/banner.py" />
            <source>{host} works only in part. What cannot be sent waits here.</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../pane/banner.py" />
            <source>No connection to {host}. Commits wait here and are sent later.</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../pane/banner.py" />
            <source>{host} does not accept the token.</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../pane/banner.py" />
            <source>Connecting to {host}…</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../pane/banner.py" />
            <source>{host} sends no live events; what you commit is shown anyway.</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../pane/banner.py" />
            <source>Live events need the package sseclient-py. What you commit is shown without it, too.</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../pane/banner.py" />
            <source>{host} (live events are off)</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../pane/boxes.py" />
            <source>Nothing has happened yet. Commit an assembly with File → Commit to Silo, and follow it here.</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../pane/boxes.py" />
            <source>Show older…</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../pane/boxes.py" />
            <source>Stop</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../pane/boxes.py" />
            <source>Retry all</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../pane/boxes.py" />
            <source>Send now</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../pane/boxes.py" />
            <source>Send all {n} commits for another address to {host}</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../pane/dock.py" />
            <location filename="../../settings/install.py" />
            <source>Database Activity</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../pane/status_sign.py" />
            <source>{n} BOM held</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../pane/status_sign.py" />
            <source>{n} BOMs held</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../pane/status_sign.py" />
            <source>{n} commit asks</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../pane/status_sign.py" />
            <source>{n} commits ask</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../pane/waiting.py" />
            <source>{n} thing waits to be sent</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../pane/waiting.py" />
            <source>{n} things wait to be sent</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../pane/waiting.py" />
            <source>{n} thing waits for your choice</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../pane/waiting.py" />
            <source>{n} things wait for your choice</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../pane/waiting.py" />
            <source>, {urgent} of them for your choice</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../pane/waiting.py" />
            <location filename="../../../outbox/status_text.py" />
            <source>BOM</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../pane/waiting.py" />
            <source>held: {why}</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../pane/waiting.py" />
            <source>Sync without what is missing</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../pane/waiting.py" />
            <source>{n} BOM is held: Silo has the file, and the BOM of before</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../pane/waiting.py" />
            <source>{n} BOMs are held: Silo has the files, and the BOMs of before</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../pane/waiting.py" />
            <source>Send to {host}</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../pane/waiting.py" />
            <source>Retry</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../pane/waiting.py" />
            <source>Open theirs beside mine</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../pane/waiting.py" />
            <source>Compare with revision {n}</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../pane/waiting.py" />
            <source>Take theirs</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../pane/waiting.py" />
            <source>Commit mine on top</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../pane/waiting.py" />
            <source>Save a copy…</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../pane/waiting.py" />
            <source>Discard</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../preview/dialog.py" />
            <source>BOM in Silo: {name}</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../preview/dialog.py" />
            <source>Comparing with Silo…</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../preview/dialog.py" />
            <location filename="../../register/dialog.py" />
            <location filename="../../revisions/dialog.py" />
            <source>Part number</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../preview/dialog.py" />
            <location filename="../../register/dialog.py" />
            <location filename="../../revisions/dialog.py" />
            <source>Name</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../preview/dialog.py" />
            <location filename="../../register/rows.py" />
            <source>Assembly</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../preview/dialog.py" />
            <location filename="../../revisions/dialog.py" />
            <source>In Silo</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../preview/dialog.py" />
            <source>What a sync does</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../preview/dialog.py" />
            <source>Show only lines that differ</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../preview/dialog.py" />
            <source>Sync although links are broken (the lines that they stand for stay as they are)</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../preview/dialog.py" />
            <source>Select the instances in the 3D view and the tree</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../preview/dialog.py" />
            <source>Why so many?</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../preview/dialog.py" />
            <source>Show each chain of links and arrays from the assembly to the part</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../preview/dialog.py" />
            <source>Count It</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../preview/dialog.py" />
            <source>Count the hidden objects of the selected row; the file keeps that</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../preview/dialog.py" />
            <source>Reference</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../preview/dialog.py" />
            <source>The hidden objects of the selected row count nowhere; the file keeps that</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../preview/dialog.py" />
            <source>Compare again</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../preview/dialog.py" />
            <source>Compare with 3D view</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../preview/dialog.py" />
            <source>Check that the BOM explains each solid in 3D, and select any other solid</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../preview/dialog.py" />
            <source>Mend links</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../preview/dialog.py" />
            <source>Sync</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../preview/dialog.py" />
            <source>Sync the {n} sub-assembly that differs too, before this one</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../preview/dialog.py" />
            <source>Sync the {n} sub-assemblies that differ too, before this one</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../preview/dialog.py" />
            <source>This assembly has no Silo part number yet. Register it to sync its BOM.</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../preview/dialog.py" />
            <source>{n} broken link: the BOM is not synced until it is mended.</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../preview/dialog.py" />
            <source>{n} broken links: the BOM is not synced until they are mended.</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../preview/dialog.py" />
            <source>… and {n} more rows</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../preview/flow.py" />
            <source>{name} holds no assembly, so it has no BOM.</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../preview/flow.py" />
            <source>BOM in Silo</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../preview/flow.py" />
            <source>{name} is not open any more. Open it, then compare again.</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../preview/flow.py" />
            <location filename="../../session/session.py" />
            <source>Comparing with Silo</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../preview/flow.py" />
            <source>Counted from now on: {names}. Save the file to keep that.</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../preview/flow.py" />
            <source>References from now on, not counted: {names}. Save the file to keep that.</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../preview/flow.py" />
            <source>Nothing was synced: {name} was edited since the comparison. Here it is now.</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../preview/rows.py" />
            <source>Without a part number: left out until registered</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../preview/rows.py" />
            <source>Modelled in this file: no items yet, never sent</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../preview/rows.py" />
            <source>Not counted, or counted with a remark</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../preview/rows.py" />
            <source>with variants: {values}</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../preview/rows.py" />
            <source>missing: {file}</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../preview/rows.py" />
            <source>… more rows than can be shown here</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../preview/rows.py" />
            <source>new in the assembly: will be added</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../preview/rows.py" />
            <source>will take the assembly's quantity</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../preview/rows.py" />
            <source>manual line in Silo with another quantity: a reviewer decides there</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../preview/rows.py" />
            <source>not in the assembly: kept, marked unreferenced</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../preview/rows.py" />
            <source>manual line: not touched</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../preview/rows.py" />
            <source>its file is missing: the line stays as it is</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../preview/rows.py" />
            <source>its own BOM is not in Silo yet</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../preview/rows.py" />
            <source>its own BOM differs from Silo</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../preview/rows.py" />
            <source>hidden, counts</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../preview/rows.py" />
            <source>hidden, does not count</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../preview/rows.py" />
            <source>hidden, only a reference: does not count</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../preview/rows.py" />
            <source>{n} to add</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../preview/rows.py" />
            <source>{n} with another quantity</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../preview/rows.py" />
            <source>{n} unreferenced</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../preview/rows.py" />
            <source>{n} in conflict</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../preview/rows.py" />
            <source>{n} without a part number</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../preview/rows.py" />
            <source>{n} missing</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../preview/rows.py" />
            <source>{n} sub-assembly is not in Silo yet</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../preview/rows.py" />
            <source>{n} sub-assemblies are not in Silo yet</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../preview/rows.py" />
            <source>{n} sub-assembly differs from Silo</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../preview/rows.py" />
            <source>{n} sub-assemblies differ from Silo</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../preview/rows.py" />
            <source>{n} line agrees</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../preview/rows.py" />
            <source>{n} lines agree</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../preview/rows.py" />
            <source>Nothing to sync: all {n} lines agree with Silo.</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../register/dialog.py" />
            <location filename="../../register/flow.py" />
            <source>Register Components</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../register/dialog.py" />
            <source>Looking for components without a part number…</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../register/dialog.py" />
            <source>Component</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../register/dialog.py" />
            <source>Source</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../register/dialog.py" />
            <source>Supplier</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../register/dialog.py" />
            <source>Supplier's number</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../register/dialog.py" />
            <source>Type</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../register/dialog.py" />
            <source>Category</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../register/dialog.py" />
            <source>Filter</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../register/dialog.py" />
            <source>Check All</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../register/dialog.py" />
            <source>None</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../register/dialog.py" />
            <source>All Certain</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../register/dialog.py" />
            <source>Source…</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../register/dialog.py" />
            <source>Category…</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../register/dialog.py" />
            <source>Type…</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../register/dialog.py" />
            <source>Supplier…</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../register/dialog.py" />
            <source>Name, as {name} left {n}</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../register/dialog.py" />
            <source>Fill Down</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../register/dialog.py" />
            <source>All chosen rows get what the first of them has in this column (Ctrl+D)</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../register/dialog.py" />
            <source>For the chosen rows:</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../register/dialog.py" />
            <source>Ask after each commit</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../register/dialog.py" />
            <source>Register Selected</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../register/dialog.py" />
            <source>Undo</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../register/dialog.py" />
            <source>Undo the last registration: archive the new items and remove them from the files</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../register/dialog.py" />
            <source>Skip All</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../register/dialog.py" />
            <source>Register</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../register/dialog.py" />
            <source>Not listed again, here or on the command line; the file keeps this choice</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../register/dialog.py" />
            <source>Not a Part</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../register/dialog.py" />
            <source>guess: {category}</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../register/dialog.py" />
            <source>Keep</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../register/dialog.py" />
            <source>Take Back</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../register/dialog.py" />
            <source>Undeclare</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../register/dialog.py" />
            <source>Declare</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../register/flow.py" />
            <source>Looking for components without a part number</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../register/flow.py" />
            <source>Reading pictures</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../register/flow.py" />
            <source>Asking for the next number</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../register/flow.py" />
            <source>Registering</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../register/flow.py" />
            <source>Undoing</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../register/flow.py" />
            <source>Registered</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../register/rows.py" />
            <source>Components</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../register/rows.py" />
            <source>Standard parts</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../register/rows.py" />
            <source>Modelled in this file, not counted</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../register/rows.py" />
            <source>Modelled in this file, and counted</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../register/rows.py" />
            <source>Modelled in this file, not a part</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../register/rows.py" />
            <source>Configured copies of parts</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../register/rows.py" />
            <source>Consumable</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../register/rows.py" />
            <source>Tool</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../register/rows.py" />
            <source>made here</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../register/rows.py" />
            <source>bought</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../register/rows.py" />
            <source>not stated</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../register/rows.py" />
            <source>all rows</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../register/rows.py" />
            <source>unsure</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../register/rows.py" />
            <source>new</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../register/rows.py" />
            <source>probable duplicates</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../register/rows.py" />
            <source>its unsaved edits are saved too</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../register/rows.py" />
            <source>open in another FreeCAD: close it there first, or saving there undoes this</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../register/rows.py" />
            <source>the file is read-only</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../register/rows.py" />
            <source>has edits, but is loaded only in part: open the file itself first</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../register/rows.py" />
            <source>has changed on disk since you opened it: open it again first</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../register/rows.py" />
            <source>the file is missing</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../register/rows.py" />
            <source>has no file yet: save it first</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../register/rows.py" />
            <source>made by a newer FreeCAD: cannot be saved here</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../register/rows.py" />
            <source>Standard part: {name}</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../register/rows.py" />
            <source>{name} ({n} copies)</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../register/rows.py" />
            <source>{number} (kept)</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../register/rows.py" />
            <source>same or new part?</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../register/rows.py" />
            <source>one for each</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../register/rows.py" />
            <source>{number} or later</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../register/rows.py" />
            <source>{number} (new)</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../register/rows.py" />
            <source>same part: keep {number}</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../register/rows.py" />
            <source>new part: a new number</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../register/rows.py" />
            <source>a new number</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../register/rows.py" />
            <source>different parts: a number for each copy</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../register/rows.py" />
            <source>stays as it is</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../register/rows.py" />
            <source>registered</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../register/rows.py" />
            <source>registering…</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../register/rows.py" />
            <source>as you chose in this folder before</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../register/rows.py" />
            <source>not a part: not listed again</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../register/rows.py" />
            <source>counts as {name}; check it to give it a number of its own</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../register/rows.py" />
            <source>counts once</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../register/rows.py" />
            <source>counts {n} times</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../register/rows.py" />
            <source>would count once; check it if it is a part</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../register/rows.py" />
            <source>would count {n} times; check it if it is a part</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../register/rows.py" />
            <source>imported from {file}</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../register/rows.py" />
            <source>equal by their labels only</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../register/rows.py" />
            <source>carries the identity of {number}, as another file does</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../register/rows.py" />
            <source>registered at another server: it keeps its identity</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../register/rows.py" />
            <source>the same content as {name}</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../register/rows.py" />
            <source>Silo has this very file as {number}</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../register/rows.py" />
            <source>Silo has {number} with the same name</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../register/rows.py" />
            <source>Silo was not searched for parts that look alike: {problem}</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../register/rows.py" />
            <source>All components of {name} have their Silo part number.</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../register/rows.py" />
            <source>All of these have their part number now.</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../register/rows.py" />
            <source>Where files carry one identity, choose in the column Part number: the same part, or a new one?</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../register/rows.py" />
            <source>({n} more after these)</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../register/rows.py" />
            <source>The following component has no Silo part number and will be excluded from the BOM until registered:</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../register/rows.py" />
            <source>The following components have no Silo part number and will be excluded from the BOM until registered:</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../revisions/dialog.py" />
            <source>Revision</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../revisions/dialog.py" />
            <source>When</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../revisions/dialog.py" />
            <source>Who</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../revisions/dialog.py" />
            <source>Comment</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../revisions/dialog.py" />
            <source>newest</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../revisions/dialog.py" />
            <source>yours</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../revisions/dialog.py" />
            <source>Fetching…</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../revisions/dialog.py" />
            <source>Opened.</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../revisions/dialog.py" />
            <source>Open from Silo</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../revisions/dialog.py" />
            <source>Part number, name or description</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../revisions/dialog.py" />
            <source>Open</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../revisions/dialog.py" />
            <source>Fetch newer revisions from Silo</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../revisions/dialog.py" />
            <source>Project folder:</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../revisions/dialog.py" />
            <source>Loading…</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../revisions/dialog.py" />
            <source>Nothing found.</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../revisions/dialog.py" />
            <source>with the newest linked files</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../revisions/dialog.py" />
            <source>It has no file in Silo.</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../revisions/dialog.py" />
            <source>Choose the project folder first.</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../revisions/dialog.py" />
            <source>It is in the project already, and is open: {path}</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../revisions/dialog.py" />
            <source>History of {name}</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../revisions/dialog.py" />
            <source>Get This Revision as a Copy…</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../revisions/dialog.py" />
            <source>Show the revision as a ghost beside yours; once more removes it</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../revisions/dialog.py" />
            <source>Compare in 3D</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../revisions/dialog.py" />
            <source>Asking Silo…</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../revisions/dialog.py" />
            <source>Comparing…</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../revisions/dialog.py" />
            <source>BOM: {changes}</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../revisions/dialog.py" />
            <source>No change of the BOM.</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../revisions/dialog.py" />
            <source>Edited here, and newer in Silo</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../revisions/dialog.py" />
            <source>What to do</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../revisions/dialog.py" />
            <source>Do It</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../revisions/dialog.py" />
            <source>Choose the project's folder</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../revisions/dialog.py" />
            <source>Refresh</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../revisions/dialog.py" />
            <source>Search</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../revisions/dialog.py" />
            <source>Different from Silo</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../revisions/dialog.py" />
            <source>Decide…</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../revisions/dialog.py" />
            <source>Commit All</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../revisions/dialog.py" />
            <source>Looking at the files…</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../revisions/dialog.py" />
            <source>Choose the project's folder: it is remembered, and marked as a project.</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../revisions/dialog.py" />
            <source>Silo: {state}</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../revisions/dialog.py" />
            <source>Choose a folder</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../revisions/dock.py" />
            <source>Silo Project</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../revisions/flow.py" />
            <source>Silo has no model of revision {n} yet.</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../revisions/flow.py" />
            <source>Fetching from Silo</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../revisions/flow.py" />
            <source>Yours is kept for {n} days at {path}</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../revisions/flow.py" />
            <source>It links to {names}, not in this folder: Open from Silo… fetches them.</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../revisions/flow.py" />
            <source>Took {who}'s revision {n}: {name}</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../revisions/flow.py" />
            <source>Took the file on disk: {name}</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../revisions/flow.py" />
            <source>Not fetched: {name}</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../revisions/flow.py" />
            <source>Searching</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../revisions/flow.py" />
            <source>Asking Silo</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../revisions/flow.py" />
            <source>This server does not know the item of this document.</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../revisions/flow.py" />
            <source>Comparing revisions</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../revisions/ghosts.py" />
            <source>The ghost is removed.</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../revisions/ghosts.py" />
            <source>Ghost: {removed} only in revision {n}, {moved} elsewhere there. Only here: {added}.</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../revisions/ghosts.py" />
            <source>Not compared: {unknown} in groups and arrays without links.</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../revisions/project.py" />
            <source>unsaved edits</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../revisions/project.py" />
            <source>was {place}</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../revisions/project.py" />
            <source>{n} files, {left} of them different from Silo</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../revisions/project.py" />
            <source>{n} BOM is held</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../revisions/project.py" />
            <source>{n} BOMs are held</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../revisions/project.py" />
            <source>Looking at the project</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../revisions/project.py" />
            <source>{place} links to {name}, which is not there.</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../revisions/project.py" />
            <source>{place} links to {name}, outside the project: it is not sent.</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../revisions/project.py" />
            <source>{place} cannot be read: {name}</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../revisions/project.py" />
            <source>{place} is a copy of {name}, which has the item.</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../revisions/project.py" />
            <source>{place} is gone since its commit.</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../revisions/pulled.py" />
            <source>{name} has edits that are not in Silo; it was left alone.</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../revisions/pulled.py" />
            <source>{name} waits to be sent; it was left alone.</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../revisions/pulled.py" />
            <source>{name} is newer than the server, which was restored from a backup; it was left alone.</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../revisions/pulled.py" />
            <source>{name} is open in FreeCAD; it was left alone.</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../revisions/pulled.py" />
            <source>{path}, which {name} links to, was not fetched: {reason}</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../session/online.py" />
            <source>No Silo server is set up yet. Enter its address in the Silo preferences.</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../session/online.py" />
            <source>{file} → {number}</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../session/session.py" />
            <source>Connecting</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../session/session.py" />
            <source>Keeping the commit</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../session/session.py" />
            <source>The commit is kept. It is sent as soon as its file can be copied.</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../session/session.py" />
            <source>Sending to Silo</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../session/session.py" />
            <source>Drawing models</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../session/session.py" />
            <source>Outbox</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../session/session.py" />
            <source>Looking at held BOMs</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../settings/connection_test.py" />
            <source>Enter the server's address too: a token belongs to its server.</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../settings/connection_test.py" />
            <source>Enter the address of the server first.</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../settings/connection_test.py" />
            <source>Connected as {user} ({role}); the server is in {mode} mode.</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../settings/connection_test.py" />
            <source>This server has no page for a login. Make a token on its account page.</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../settings/connection_test.py" />
            <source>No server is set up. To try it out, run: silo-mod serve</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../settings/connection_test.py" />
            <source>from the environment variable SILO_API_URL</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../settings/connection_test.py" />
            <source>from this page</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../settings/connection_test.py" />
            <source>from the configuration file of silo-mod</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../settings/connection_test.py" />
            <source>Token: from the environment variable SILO_API_TOKEN.</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../settings/connection_test.py" />
            <source>Token: from the system's keyring.</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../settings/connection_test.py" />
            <source>Token: from FreeCAD's preferences, a plain file.</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../settings/connection_test.py" />
            <source>Token: from the configuration file of silo-mod.</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../settings/connection_test.py" />
            <source>Token: none.</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../settings/connection_test.py" />
            <source>In use: {url} ({from}).</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../settings/connection_test.py" />
            <source>SILO_SSL_VERIFY decides about the certificate.</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../settings/help.py" />
            <source>Help on Silo</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../settings/help.py" />
            <source>The documentation is not there: {path}</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../settings/install.py" />
            <source>Silo cannot start yet: FreeCAD's Python lacks {names}.</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../settings/install.py" />
            <source>Install what Silo needs</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../settings/install.py" />
            <source>Silo needs these Python packages: {names}.
They are installed in {folder}.</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../settings/install.py" />
            <source>Install</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../settings/install.py" />
            <source>Installing. This takes a minute or two…</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../settings/install.py" />
            <source>The packages are in {folder}. Start FreeCAD again to use Silo.</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../settings/install.py" />
            <source>They could not be installed: {reason}</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../settings/page.py" />
            <source>Server</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../settings/page.py" />
            <source>Address</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../settings/page.py" />
            <source>Log in…</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../settings/page.py" />
            <source>API token</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../settings/page.py" />
            <source>FreeCAD's preferences (a plain file)</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../settings/page.py" />
            <source>Keep the token in</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../settings/page.py" />
            <source>Check the server's certificate</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../settings/page.py" />
            <source>the system's own, unless a file is given</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../settings/page.py" />
            <source>Certificate authorities</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../settings/page.py" />
            <source>Test the connection</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../settings/page.py" />
            <source>Ask for a comment</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../settings/page.py" />
            <source>Sync the BOM of an assembly after its file is committed</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../settings/page.py" />
            <source>Then ask about components without a part number</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../settings/page.py" />
            <source>Count standard parts (screws, nuts, washers) in the BOM</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../settings/page.py" />
            <source>hold the BOM back until they are mended</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../settings/page.py" />
            <source>sync without them (they become unreferenced)</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../settings/page.py" />
            <source>Where links are broken</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../settings/page.py" />
            <source>Part number schema</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../settings/page.py" />
            <source>Window</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../settings/page.py" />
            <source>Show events of Silo live</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../settings/page.py" />
            <source>Commit in the File menu of every workbench</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../settings/page.py" />
            <source>Reading the settings</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../settings/page.py" />
            <source>the keyring of the system ({name})</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../settings/page.py" />
            <source>unchanged; enter another one to replace it</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../settings/page.py" />
            <source>none yet: make one on the server's page</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../settings/page.py" />
            <source>Keeping the token</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../settings/page.py" />
            <source>Asking the server…</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../settings/page.py" />
            <source>Testing the connection</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../settings/page.py" />
            <source>Let FreeCAD in on the page that opens. It shows the code {code}.</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../settings/page.py" />
            <source>Waiting for the browser</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../settings/page.py" />
            <source>You are logged in. Press OK to keep the token.</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../settings/page.py" />
            <source>Asking for the login page</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../start.py" />
            <source>Silo is installed more than once: {folders}. Only {used} is used; remove the others.</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../start.py" />
            <source>Keep the BOM of an assembly in step with Silo</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../words.py" />
            <source>en</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../../bom_sync/activity_text.py" />
            <source>BOM Updated: {number}</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../../bom_sync/activity_text.py" />
            <source>+{n} added</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../../bom_sync/activity_text.py" />
            <source>~{n} qty changed</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../../bom_sync/activity_text.py" />
            <source>⚠{n} unreferenced</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../../bom_sync/activity_text.py" />
            <source>⚡{n} in conflict</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../../bom_sync/activity_text.py" />
            <source>no changes</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../../bom_sync/activity_text.py" />
            <source>{n} component has no Silo part number</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../../bom_sync/activity_text.py" />
            <source>{n} components have no Silo part number</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../../bom_sync/activity_text.py" />
            <source>This is part of draft {draft}. Revision {released} stays released as it is.</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../../bom_sync/activity_text.py" />
            <source>{value} for {n} of {all} parts</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../../bom_sync/activity_text.py" />
            <source>The category rules of this Silo are not used until they are mended: {problem}</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../../outbox/status_text.py" />
            <source>It is meant for {there}, which is not the server in use.</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../../outbox/status_text.py" />
            <source>for another server</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../../outbox/status_text.py" />
            <source>out of date</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../../outbox/status_text.py" />
            <source>A newer commit of it has arrived since; this one would undo it.</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../../outbox/status_text.py" />
            <source>being copied</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../../outbox/status_text.py" />
            <source>Its file is being copied.</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../../outbox/status_text.py" />
            <source>paused</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../../outbox/status_text.py" />
            <source>tried again later</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../../outbox/status_text.py" />
            <source>waiting</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../../outbox/status_text.py" />
            <source>file and BOM</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../../outbox/status_text.py" />
            <source>file</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../../outbox/status_text.py" />
            <source>Nothing is sent to {host} before you retry: {reason}</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../../outbox/status_text.py" />
            <source>Nothing is sent to {host} for {time}: {reason}</source>
            <translation type="unfinished" />
        </message>
    </context>
    <context>
        <name>Origin_Commit</name>
        <message>
            <location filename="../../commands.py" />
            <source>Commit to Silo</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../commands.py" />
            <source>Save this document and its changed sub-assemblies, upload them as new revisions, and bring the BOM to Silo</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../commands.py" />
            <source>Saves this document and the edited ones below it, uploads each as a new revision with your comment, and brings the BOM to Silo. Nothing is ever deleted there.</source>
            <translation type="unfinished" />
        </message>
    </context>
    <context>
        <name>Silo_BOM</name>
        <message>
            <location filename="../../commands.py" />
            <source>Compare BOM with Silo…</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../commands.py" />
            <source>Show how the BOM of this assembly differs from the one in Silo</source>
            <translation type="unfinished" />
        </message>
    </context>
    <context>
        <name>Silo_RegisterParts</name>
        <message>
            <location filename="../../commands.py" />
            <source>Register Parts…</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../commands.py" />
            <source>Give part numbers to the components of this assembly that have none</source>
            <translation type="unfinished" />
        </message>
    </context>
    <context>
        <name>Silo_Mass</name>
        <message>
            <location filename="../../commands.py" />
            <source>Mass of the Assembly…</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../commands.py" />
            <source>Mass and centre of mass from the parts' shapes and materials, with what is missing</source>
            <translation type="unfinished" />
        </message>
    </context>
    <context>
        <name>Silo_Activity</name>
        <message>
            <location filename="../../commands.py" />
            <source>Database Activity</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../commands.py" />
            <source>Show events in Silo, and commits that wait to be sent</source>
            <translation type="unfinished" />
        </message>
    </context>
    <context>
        <name>Silo_Open</name>
        <message>
            <location filename="../../commands.py" />
            <source>Open from Silo…</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../commands.py" />
            <source>Find an item in Silo and open its file with all that it links to</source>
            <translation type="unfinished" />
        </message>
    </context>
    <context>
        <name>Silo_Project</name>
        <message>
            <location filename="../../commands.py" />
            <source>Project</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../commands.py" />
            <source>All files of the project, which of them Silo has, and Commit All</source>
            <translation type="unfinished" />
        </message>
    </context>
    <context>
        <name>Silo_History</name>
        <message>
            <location filename="../../commands.py" />
            <source>History…</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../commands.py" />
            <source>The revisions of this document: who, when, and what changed in the BOM</source>
            <translation type="unfinished" />
        </message>
    </context>
    <context>
        <name>Silo_Settings</name>
        <message>
            <location filename="../../commands.py" />
            <source>Silo Settings…</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../commands.py" />
            <source>Server, token, and what a commit does</source>
            <translation type="unfinished" />
        </message>
    </context>
    <context>
        <name>Silo_Help</name>
        <message>
            <location filename="../../commands.py" />
            <source>Help on Silo</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../commands.py" />
            <source>Open the page that explains the commands, the pane and the messages</source>
            <translation type="unfinished" />
        </message>
    </context>
    <context>
        <name>Silo_InstallPackages</name>
        <message>
            <location filename="../../settings/install.py" />
            <source>Install What Silo Needs…</source>
            <translation type="unfinished" />
        </message>
        <message>
            <location filename="../../settings/install.py" />
            <source>Install the Python packages that Silo needs</source>
            <translation type="unfinished" />
        </message>
    </context>
</TS>
