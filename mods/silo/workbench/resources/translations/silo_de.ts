<?xml version="1.0" encoding="utf-8"?>
<!DOCTYPE TS>
<TS version="2.1" sourcelanguage="en" language="de">
    <context>
        <name>Silo</name>
        <message>
            <location filename="../../activity/box.py" />
            <location filename="../../colleagues/theirs.py" />
            <source>… and {n} more line</source>
            <translation>… und {n} weitere Zeile</translation>
        </message>
        <message>
            <location filename="../../activity/box.py" />
            <source>… and {n} more lines; the preview shows all</source>
            <translation>… und {n} weitere Zeilen; der Vergleich zeigt alle</translation>
        </message>
        <message>
            <location filename="../../activity/events.py" />
            <source>The server no longer has the events since then. See its own activity page.</source>
            <translation>Der Server weiß nicht mehr, was seither geschah. Seine eigene Seite zeigt die Aktivität.</translation>
        </message>
        <message>
            <location filename="../../activity/events.py" />
            <source>Some activity may be missing</source>
            <translation>Ein Teil der Aktivität fehlt vielleicht</translation>
        </message>
        <message>
            <location filename="../../activity/events.py" />
            <source>Revision {n} of {number}</source>
            <translation>Revision {n} von {number}</translation>
        </message>
        <message>
            <location filename="../../activity/events.py" />
            <source>New item: {number}</source>
            <translation>Neuer Artikel: {number}</translation>
        </message>
        <message>
            <location filename="../../activity/events.py" />
            <source>Archived: {number}</source>
            <translation>Archiviert: {number}</translation>
        </message>
        <message>
            <location filename="../../activity/feed.py" />
            <source>{n} items committed</source>
            <translation>{n} Artikel eingecheckt</translation>
        </message>
        <message>
            <location filename="../../activity/feed.py" />
            <source>{n} new items</source>
            <translation>{n} neue Artikel</translation>
        </message>
        <message>
            <location filename="../../activity/feed.py" />
            <source>{n} new revisions</source>
            <translation>{n} neue Revisionen</translation>
        </message>
        <message>
            <location filename="../../activity/links.py" />
            <location filename="../../preview/dialog.py" />
            <source>View in Silo →</source>
            <translation>In Silo ansehen →</translation>
        </message>
        <message>
            <location filename="../../activity/sent.py" />
            <source>BOM not synced: {number}</source>
            <translation>Stückliste nicht abgeglichen: {number}</translation>
        </message>
        <message>
            <location filename="../../activity/sent.py" />
            <source>Committed: {number}</source>
            <translation>Eingecheckt: {number}</translation>
        </message>
        <message>
            <location filename="../../activity/sent.py" />
            <source>BOM unchanged</source>
            <translation>Stückliste unverändert</translation>
        </message>
        <message>
            <location filename="../../activity/sent.py" />
            <source>Revision {n} uploaded</source>
            <translation>Revision {n} hochgeladen</translation>
        </message>
        <message>
            <location filename="../../activity/sent.py" />
            <source>The file is in Silo already</source>
            <translation>Die Datei ist schon in Silo</translation>
        </message>
        <message>
            <location filename="../../activity/sent.py" />
            <source>{n} item in the Silo BOM is not referenced by components in this assembly.</source>
            <translation>{n} Artikel der Stückliste in Silo wird von keiner Komponente dieser Baugruppe verwendet.</translation>
        </message>
        <message>
            <location filename="../../activity/sent.py" />
            <source>{n} items in the Silo BOM are not referenced by components in this assembly.</source>
            <translation>{n} Artikel der Stückliste in Silo werden von keiner Komponente dieser Baugruppe verwendet.</translation>
        </message>
        <message>
            <location filename="../../activity/sent.py" />
            <source>Incomplete: {n} component is missing; its known line stays as it is.</source>
            <translation>Unvollständig: {n} Komponente fehlt; ihre bekannte Position bleibt, wie sie ist.</translation>
        </message>
        <message>
            <location filename="../../activity/sent.py" />
            <source>Incomplete: {n} components are missing; their known lines stay as they are.</source>
            <translation>Unvollständig: {n} Komponenten fehlen; ihre bekannten Positionen bleiben, wie sie sind.</translation>
        </message>
        <message>
            <location filename="../../activity/sent.py" />
            <source>The file is in Silo. The BOM waits until these are mended:</source>
            <translation>Die Datei ist in Silo. Die Stückliste wartet, bis dies behoben ist:</translation>
        </message>
        <message>
            <location filename="../../activity/sent.py" />
            <source>Sync without it</source>
            <translation>Ohne sie abgleichen</translation>
        </message>
        <message>
            <location filename="../../activity/sent.py" />
            <source>Sync without them</source>
            <translation>Ohne diese abgleichen</translation>
        </message>
        <message>
            <location filename="../../activity/sent.py" />
            <location filename="../../pane/waiting.py" />
            <source>Relink…</source>
            <translation>Neu verknüpfen…</translation>
        </message>
        <message>
            <location filename="../../activity/sent.py" />
            <source>Show all…</source>
            <translation>Alle zeigen…</translation>
        </message>
        <message>
            <location filename="../../activity/sent.py" />
            <source>Open in {bom}</source>
            <translation>In {bom} öffnen</translation>
        </message>
        <message>
            <location filename="../../activity/sent.py" />
            <location filename="../../pane/waiting.py" />
            <source>Same part</source>
            <translation>Gleiches Teil</translation>
        </message>
        <message>
            <location filename="../../activity/sent.py" />
            <location filename="../../pane/waiting.py" />
            <source>New part…</source>
            <translation>Neues Teil…</translation>
        </message>
        <message>
            <location filename="../../activity/sent.py" />
            <location filename="../../pane/waiting.py" />
            <location filename="../../preview/dialog.py" />
            <source>Show</source>
            <translation>Zeigen</translation>
        </message>
        <message>
            <location filename="../../activity/sent.py" />
            <source>{number}: the assembly has {cad}, a manual line in Silo says {silo}</source>
            <translation>{number}: Die Baugruppe hat {cad}, eine manuelle Position in Silo sagt {silo}</translation>
        </message>
        <message>
            <location filename="../../activity/sent.py" />
            <location filename="../../commit/flow.py" />
            <location filename="../../preview/dialog.py" />
            <source>Register Parts…</source>
            <translation>Teile registrieren…</translation>
        </message>
        <message>
            <location filename="../../activity/team.py" />
            <source>A file that is saved here may hold objects that the FreeCAD of your colleagues does not know and does not load.</source>
            <translation>Eine hier gespeicherte Datei kann Objekte enthalten, die das FreeCAD der anderen nicht kennt und nicht lädt.</translation>
        </message>
        <message>
            <location filename="../../activity/team.py" />
            <source>Files of your colleagues may hold objects that this FreeCAD does not know. You are asked before a save removes such objects from a file.</source>
            <translation>Dateien der anderen können Objekte enthalten, die dieses FreeCAD nicht kennt. Bevor Speichern solche Objekte aus einer Datei entfernt, werden Sie gefragt.</translation>
        </message>
        <message>
            <location filename="../../activity/team.py" />
            <source>Your team works with FreeCAD {team}; this is {here}</source>
            <translation>Ihr Team arbeitet mit FreeCAD {team}; dies ist {here}</translation>
        </message>
        <message>
            <location filename="../../addon.py" />
            <source>Looking at the server</source>
            <translation>Server wird abgefragt</translation>
        </message>
        <message>
            <location filename="../../addon.py" />
            <source>Save over it</source>
            <translation>Darüber speichern</translation>
        </message>
        <message>
            <location filename="../../addon.py" />
            <source>Keep the newer file</source>
            <translation>Neuere Datei behalten</translation>
        </message>
        <message>
            <location filename="../../addon.py" />
            <source>History</source>
            <translation>Verlauf</translation>
        </message>
        <message>
            <location filename="../../addon.py" />
            <source>{name} has no Silo part number yet. Register it first.</source>
            <translation>{name} hat noch keine Silo-Teilenummer. Bitte zuerst registrieren.</translation>
        </message>
        <message>
            <location filename="../../buttons.py" />
            <source>Save a copy</source>
            <translation>Kopie speichern</translation>
        </message>
        <message>
            <location filename="../../buttons.py" />
            <source>This document is not open any more.</source>
            <translation>Dieses Dokument ist nicht mehr offen.</translation>
        </message>
        <message>
            <location filename="../../buttons.py" />
            <source>[Silo] This document is not open: </source>
            <translation>[Silo] Dieses Dokument ist nicht offen: </translation>
        </message>
        <message>
            <location filename="../../buttons.py" />
            <source>[Silo] Not opened, for it is not on the Silo server in use: </source>
            <translation>[Silo] Nicht geöffnet, denn es liegt nicht auf dem verwendeten Silo-Server: </translation>
        </message>
        <message>
            <location filename="../../buttons.py" />
            <source>No browser could be opened. The address was copied.</source>
            <translation>Kein Browser ließ sich öffnen. Die Adresse wurde kopiert.</translation>
        </message>
        <message>
            <location filename="../../buttons.py" />
            <source>[Silo] No browser could be opened; the address was copied: </source>
            <translation>[Silo] Kein Browser ließ sich öffnen; die Adresse wurde kopiert: </translation>
        </message>
        <message>
            <location filename="../../buttons.py" />
            <source>[Silo] These objects are not in the document any more.</source>
            <translation>[Silo] Diese Objekte sind nicht mehr im Dokument.</translation>
        </message>
        <message>
            <location filename="../../buttons.py" />
            <source>[Silo] The first {n} of {all} objects are selected.</source>
            <translation>[Silo] Die ersten {n} von {all} Objekten sind ausgewählt.</translation>
        </message>
        <message>
            <location filename="../../colleagues/states.py" />
            <location filename="../../freecad/silo_group.py" />
            <source>in Silo</source>
            <translation>in Silo</translation>
        </message>
        <message>
            <location filename="../../colleagues/states.py" />
            <source>not in Silo</source>
            <translation>nicht in Silo</translation>
        </message>
        <message>
            <location filename="../../colleagues/states.py" />
            <source>edited since its commit</source>
            <translation>seit dem Einchecken geändert</translation>
        </message>
        <message>
            <location filename="../../colleagues/states.py" />
            <source>newer in Silo</source>
            <translation>neuer in Silo</translation>
        </message>
        <message>
            <location filename="../../colleagues/states.py" />
            <source>edited, and newer in Silo</source>
            <translation>geändert, und neuer in Silo</translation>
        </message>
        <message>
            <location filename="../../colleagues/states.py" />
            <source>waits to be sent</source>
            <translation>wartet auf das Senden</translation>
        </message>
        <message>
            <location filename="../../colleagues/states.py" />
            <location filename="../../../outbox/status_text.py" />
            <source>held for your choice</source>
            <translation>wartet auf Ihre Entscheidung</translation>
        </message>
        <message>
            <location filename="../../colleagues/states.py" />
            <source>the server was restored from a backup: it has an older one</source>
            <translation>der Server wurde aus einer Sicherung wiederhergestellt: er hat eine ältere</translation>
        </message>
        <message>
            <location filename="../../colleagues/states.py" />
            <source>its item is not on this server</source>
            <translation>sein Artikel ist nicht auf diesem Server</translation>
        </message>
        <message>
            <location filename="../../colleagues/theirs.py" />
            <source>leave out</source>
            <translation>weglassen</translation>
        </message>
        <message>
            <location filename="../../colleagues/theirs.py" />
            <source>open theirs beside mine</source>
            <translation>fremde neben meiner öffnen</translation>
        </message>
        <message>
            <location filename="../../colleagues/theirs.py" />
            <source>take theirs</source>
            <translation>fremde übernehmen</translation>
        </message>
        <message>
            <location filename="../../colleagues/theirs.py" />
            <source>commit mine on top</source>
            <translation>meine darüber einchecken</translation>
        </message>
        <message>
            <location filename="../../colleagues/theirs.py" />
            <source>the file on disk was changed since you opened it</source>
            <translation>die Datei auf der Platte wurde geändert, seit Sie sie geöffnet haben</translation>
        </message>
        <message>
            <location filename="../../colleagues/theirs.py" />
            <source>a file that is no revision in Silo</source>
            <translation>einer Datei, die keine Revision in Silo ist</translation>
        </message>
        <message>
            <location filename="../../colleagues/theirs.py" />
            <source>revision {n}</source>
            <translation>Revision {n}</translation>
        </message>
        <message>
            <location filename="../../colleagues/theirs.py" />
            <location filename="../../commit/dialog.py" />
            <location filename="../../pane/banner.py" />
            <source>Somebody</source>
            <translation>Jemand</translation>
        </message>
        <message>
            <location filename="../../colleagues/theirs.py" />
            <source>{who} committed revision {n}; yours was made from {base}</source>
            <translation>{who} hat Revision {n} eingecheckt; Ihre entstand aus {base}</translation>
        </message>
        <message>
            <location filename="../../colleagues/theirs.py" />
            <source>{name}: {theirs} in theirs, {mine} in yours</source>
            <translation>{name}: {theirs} in der fremden, {mine} in Ihrer</translation>
        </message>
        <message>
            <location filename="../../colleagues/theirs.py" />
            <source>{name}: {base} → {mine} by both of you</source>
            <translation>{name}: {base} → {mine} von beiden</translation>
        </message>
        <message>
            <location filename="../../colleagues/theirs.py" />
            <source>{name}: {base} → {theirs} by them, {mine} by you</source>
            <translation>{name}: {base} → {theirs} von anderen, {mine} von Ihnen</translation>
        </message>
        <message>
            <location filename="../../colleagues/theirs.py" />
            <source>{name}: {base} → {theirs} by them, as before in yours</source>
            <translation>{name}: {base} → {theirs} von anderen, bei Ihnen wie zuvor</translation>
        </message>
        <message>
            <location filename="../../colleagues/theirs.py" />
            <source>{name}: {base} → {mine} by you, as before in theirs</source>
            <translation>{name}: {base} → {mine} von Ihnen, bei anderen wie zuvor</translation>
        </message>
        <message>
            <location filename="../../colleagues/theirs.py" />
            <source>… and {n} more lines</source>
            <translation>… und {n} weitere Zeilen</translation>
        </message>
        <message>
            <location filename="../../commit/below.py" />
            <source>Not all files below it are in Silo: {name}</source>
            <translation>Nicht alle Dateien darunter sind in Silo: {name}</translation>
        </message>
        <message>
            <location filename="../../commit/below.py" />
            <source>{n} file of it is in Silo as it is here: {name}</source>
            <translation>{n} Datei davon ist in Silo wie hier: {name}</translation>
        </message>
        <message>
            <location filename="../../commit/below.py" />
            <source>{n} files of it are in Silo as they are here: {name}</source>
            <translation>{n} Dateien davon sind in Silo wie hier: {name}</translation>
        </message>
        <message>
            <location filename="../../commit/below.py" />
            <source>{n} file of it waits to be sent: {name}</source>
            <translation>{n} Datei davon wartet auf das Senden: {name}</translation>
        </message>
        <message>
            <location filename="../../commit/below.py" />
            <source>{n} files of it wait to be sent: {name}</source>
            <translation>{n} Dateien davon warten auf das Senden: {name}</translation>
        </message>
        <message>
            <location filename="../../commit/below.py" />
            <location filename="../../revisions/project.py" />
            <source>its BOM is held: {why}</source>
            <translation>ihre Stückliste wird zurückgehalten: {why}</translation>
        </message>
        <message>
            <location filename="../../commit/below.py" />
            <source>sent</source>
            <translation>gesendet</translation>
        </message>
        <message>
            <location filename="../../commit/below.py" />
            <source>the same</source>
            <translation>unverändert</translation>
        </message>
        <message>
            <location filename="../../commit/dialog.py" />
            <location filename="../../commit/flow.py" />
            <source>Commit to Silo</source>
            <translation>In Silo einchecken</translation>
        </message>
        <message>
            <location filename="../../commit/dialog.py" />
            <source>What changed?</source>
            <translation>Was wurde geändert?</translation>
        </message>
        <message>
            <location filename="../../commit/dialog.py" />
            <source>A comment for this revision (may stay empty)</source>
            <translation>Kommentar zu dieser Revision (darf leer bleiben)</translation>
        </message>
        <message>
            <location filename="../../commit/dialog.py" />
            <source>Register it in Silo as well: it has no part number yet</source>
            <translation>Auch in Silo registrieren: Das Dokument hat noch keine Teilenummer</translation>
        </message>
        <message>
            <location filename="../../commit/dialog.py" />
            <source>Looking for what colleagues committed since…</source>
            <translation>Prüfen, was andere seither eingecheckt haben…</translation>
        </message>
        <message>
            <location filename="../../commit/dialog.py" />
            <source>This file will be committed:</source>
            <translation>Diese Datei wird übertragen:</translation>
        </message>
        <message>
            <location filename="../../commit/dialog.py" />
            <source>This file will be committed after {n} file below it with unsaved edits:</source>
            <translation>Diese Datei wird eingecheckt, und zuvor {n} Datei darunter mit ungespeicherten Änderungen:</translation>
        </message>
        <message>
            <location filename="../../commit/dialog.py" />
            <source>This file will be committed after {n} files below it with unsaved edits, the lowest first:</source>
            <translation>Diese Datei wird eingecheckt, und zuvor {n} Dateien darunter mit ungespeicherten Änderungen, die unterste zuerst:</translation>
        </message>
        <message>
            <location filename="../../commit/dialog.py" />
            <source>{n} more file was only recomputed; check it to commit it anyway.</source>
            <translation>{n} weitere wurde nur neu berechnet; anhaken, um sie trotzdem einzuchecken.</translation>
        </message>
        <message>
            <location filename="../../commit/dialog.py" />
            <source>{n} more files were only recomputed; check them to commit them anyway.</source>
            <translation>{n} weitere wurden nur neu berechnet; anhaken, um sie trotzdem einzuchecken.</translation>
        </message>
        <message>
            <location filename="../../commit/dialog.py" />
            <location filename="../../revisions/dialog.py" />
            <source>File</source>
            <translation>Datei</translation>
        </message>
        <message>
            <location filename="../../commit/dialog.py" />
            <location filename="../../revisions/dialog.py" />
            <source>State</source>
            <translation>Zustand</translation>
        </message>
        <message>
            <location filename="../../commit/dialog.py" />
            <source>Select:</source>
            <translation>Auswählen:</translation>
        </message>
        <message>
            <location filename="../../commit/dialog.py" />
            <source>edited</source>
            <translation>geänderte</translation>
        </message>
        <message>
            <location filename="../../commit/dialog.py" />
            <source>all</source>
            <translation>alle</translation>
        </message>
        <message>
            <location filename="../../commit/dialog.py" />
            <source>none</source>
            <translation>keine</translation>
        </message>
        <message>
            <location filename="../../commit/dialog.py" />
            <source>only this file</source>
            <translation>nur diese Datei</translation>
        </message>
        <message>
            <location filename="../../commit/dialog.py" />
            <location filename="../../settings/page.py" />
            <source>Commit</source>
            <translation>Einchecken</translation>
        </message>
        <message>
            <location filename="../../commit/dialog.py" />
            <source>Ctrl+Return</source>
            <translation>Strg+Eingabe</translation>
        </message>
        <message>
            <location filename="../../commit/dialog.py" />
            <source>Cancel</source>
            <translation>Abbrechen</translation>
        </message>
        <message>
            <location filename="../../commit/dialog.py" />
            <source>Files that somebody else has changed are left out, unless you choose otherwise:</source>
            <translation>Was jemand anders geändert hat, bleibt weg, wenn Sie nichts anderes wählen:</translation>
        </message>
        <message>
            <location filename="../../commit/dialog.py" />
            <source>(no comment)</source>
            <translation>(kein Kommentar)</translation>
        </message>
        <message>
            <location filename="../../commit/dialog.py" />
            <source>Commit to Silo – {who} committed since you opened</source>
            <translation>In Silo einchecken – {who} hat eingecheckt, seit Sie geöffnet haben</translation>
        </message>
        <message>
            <location filename="../../commit/dialog.py" />
            <source>Commit to Silo – changed on disk since you opened</source>
            <translation>In Silo einchecken – auf der Platte geändert, seit Sie geöffnet haben</translation>
        </message>
        <message>
            <location filename="../../commit/dialog.py" />
            <source>Do it</source>
            <translation>Ausführen</translation>
        </message>
        <message>
            <location filename="../../commit/flow.py" />
            <source>Looking at the linked files</source>
            <translation>Verknüpfte Dateien werden geprüft</translation>
        </message>
        <message>
            <location filename="../../commit/flow.py" />
            <source>Looking at what Silo has now</source>
            <translation>Sieht nach, was Silo jetzt hat</translation>
        </message>
        <message>
            <location filename="../../commit/flow.py" />
            <location filename="../../session/session.py" />
            <source>Looking for colleagues' commits</source>
            <translation>Prüfen, was andere eingecheckt haben</translation>
        </message>
        <message>
            <location filename="../../commit/flow.py" />
            <source>Its BOM was not synced: it changed after its commit. Commit it again.</source>
            <translation>Die Stückliste wurde nicht abgeglichen: Sie ist nicht mehr so wie eingecheckt. Bitte einchecken.</translation>
        </message>
        <message>
            <location filename="../../commit/flow.py" />
            <source>Not committed: {name}</source>
            <translation>Nicht eingecheckt: {name}</translation>
        </message>
        <message>
            <location filename="../../commit/flow.py" />
            <source>No Silo server is set up: the files are saved, and wait to be sent.</source>
            <translation>Kein Silo-Server ist eingerichtet: Die Dateien sind gespeichert und warten auf das Senden.</translation>
        </message>
        <message>
            <location filename="../../commit/flow.py" />
            <source>There is no connection now: the files are saved, and sent later.</source>
            <translation>Zurzeit besteht keine Verbindung: Die Dateien sind gespeichert und werden später gesendet.</translation>
        </message>
        <message>
            <location filename="../../commit/flow.py" />
            <source>It has no Silo part number yet, so it was not sent.</source>
            <translation>Noch keine Silo-Teilenummer, daher nicht gesendet.</translation>
        </message>
        <message>
            <location filename="../../commit/flow.py" />
            <source>Saved, but not in Silo: {name}</source>
            <translation>Gespeichert, aber nicht in Silo: {name}</translation>
        </message>
        <message>
            <location filename="../../commit/plan.py" />
            <source>another program changed the file since it was opened: reload it, or commit yours over it</source>
            <translation>ein anderes Programm hat die Datei seit dem Öffnen geändert: laden Sie sie neu, oder checken Sie Ihre darüber ein</translation>
        </message>
        <message>
            <location filename="../../commit/plan.py" />
            <source>unsaved edits: will be saved</source>
            <translation>ungespeicherte Änderungen: werden gespeichert</translation>
        </message>
        <message>
            <location filename="../../commit/plan.py" />
            <source>recomputed only: nothing differs from the file</source>
            <translation>nur neu berechnet: gleicht der Datei</translation>
        </message>
        <message>
            <location filename="../../commit/plan.py" />
            <source>saved already</source>
            <translation>schon gespeichert</translation>
        </message>
        <message>
            <location filename="../../commit/plan.py" />
            <source>has no file yet: save it under a name first</source>
            <translation>hat noch keine Datei: zuerst unter einem Namen speichern</translation>
        </message>
        <message>
            <location filename="../../commit/plan.py" />
            <source>FreeCAD has loaded it only in part and cannot save these edits: open the file itself and make them there</source>
            <translation>FreeCAD hat sie nur teilweise geladen und kann diese Änderungen nicht speichern: Öffnen Sie die Datei selbst und ändern Sie dort</translation>
        </message>
        <message>
            <location filename="../../commit/plan.py" />
            <source>the file is read-only: these edits are not saved</source>
            <translation>die Datei ist schreibgeschützt: diese Änderungen werden nicht gespeichert</translation>
        </message>
        <message>
            <location filename="../../commit/plan.py" />
            <source>made by a newer FreeCAD: saving it here would destroy {lost}, so it is not saved. Make these edits in the newer FreeCAD</source>
            <translation>von einem neueren FreeCAD: Speichern würde hier {lost} zerstören, daher unterbleibt es. Ändern Sie im neueren FreeCAD</translation>
        </message>
        <message>
            <location filename="../../commit/plan.py" />
            <source>the file is damaged, and FreeCAD has opened what it could read of it: fetch the file again, or check that nothing is missing and save it in FreeCAD yourself</source>
            <translation>die Datei ist beschädigt, FreeCAD hat geöffnet, was lesbar war: Holen Sie die Datei neu, oder prüfen Sie, dass nichts fehlt, und speichern Sie selbst in FreeCAD</translation>
        </message>
        <message>
            <location filename="../../commit/plan.py" />
            <source>{name} has no file yet. Save it under a name first.</source>
            <translation>{name} hat noch keine Datei. Bitte zuerst unter einem Namen speichern.</translation>
        </message>
        <message>
            <location filename="../../commit/take.py" />
            <source>It was closed before it was saved: open it and commit it again.</source>
            <translation>Vor dem Speichern geschlossen: Bitte öffnen und noch einmal einchecken.</translation>
        </message>
        <message>
            <location filename="../../documents/snapshot.py" />
            <source>Make the right assembly active: double-click it in the tree.</source>
            <translation>Aktivieren Sie die gemeinte Baugruppe: Doppelklick im Baum.</translation>
        </message>
        <message>
            <location filename="../../freecad/loss_guard.py" />
            <source>This FreeCAD {here} does not know these objects, nor load them: {lost}.</source>
            <translation>Dieses FreeCAD {here} kennt nicht und hat nicht geladen: {lost}.</translation>
        </message>
        <message>
            <location filename="../../freecad/loss_guard.py" />
            <source>Saving the file here would remove them from it: change it there.</source>
            <translation>Speichern würde sie hier aus der Datei entfernen: Ändern Sie die Datei dort.</translation>
        </message>
        <message>
            <location filename="../../freecad/loss_guard.py" />
            <source>{name} was saved by FreeCAD {there}. This FreeCAD {here} does not know, and would remove from the file: {lost}.</source>
            <translation>{name} wurde mit FreeCAD {there} gespeichert. Dieses FreeCAD {here} kennt nicht und würde aus der Datei entfernen: {lost}.</translation>
        </message>
        <message>
            <location filename="../../freecad/loss_guard.py" />
            <source>Newer file</source>
            <translation>Neuere Datei</translation>
        </message>
        <message>
            <location filename="../../freecad/loss_guard.py" />
            <source>Saved over the newer file, without {lost}.</source>
            <translation>Über die neuere Datei gespeichert, ohne {lost}.</translation>
        </message>
        <message>
            <location filename="../../freecad/loss_guard.py" />
            <source>The newer file is kept for {n} days at {path}</source>
            <translation>Die neuere Datei wird {n} Tage aufbewahrt: {path}</translation>
        </message>
        <message>
            <location filename="../../freecad/loss_guard.py" />
            <source>What you saved is kept for {n} days at {path}</source>
            <translation>Was Sie gespeichert haben, wird {n} Tage aufbewahrt: {path}</translation>
        </message>
        <message>
            <location filename="../../freecad/loss_guard.py" />
            <source>The newer file was kept.</source>
            <translation>Die neuere Datei wurde behalten.</translation>
        </message>
        <message>
            <location filename="../../freecad/loss_guard.py" />
            <source>Made by a newer FreeCAD: {name}</source>
            <translation>Von einem neueren FreeCAD: {name}</translation>
        </message>
        <message>
            <location filename="../../freecad/silo_group.py" />
            <source>not registered: left out of the BOM</source>
            <translation>nicht registriert: fehlt in der Stückliste</translation>
        </message>
        <message>
            <location filename="../../freecad/silo_group.py" />
            <source>Part number in Silo</source>
            <translation>Teilenummer in Silo</translation>
        </message>
        <message>
            <location filename="../../freecad/silo_group.py" />
            <source>Silo's data of this component</source>
            <translation>Was Silo über diese Komponente weiß</translation>
        </message>
        <message>
            <location filename="../../gui/closing.py" />
            <location filename="../../settings/page.py" />
            <location filename="../../start.py" />
            <source>Silo</source>
            <translation>Silo</translation>
        </message>
        <message>
            <location filename="../../gui/closing.py" />
            <source>Your commits are being copied to the outbox. They are sent when FreeCAD is started the next time.
Commits that are not copied by then may have to be committed again.</source>
            <translation>Eingechecktes wird gerade in den Postausgang kopiert. Gesendet wird es beim nächsten Start von FreeCAD.
Was bis dahin nicht kopiert ist, muss vielleicht noch einmal eingecheckt werden.</translation>
        </message>
        <message>
            <location filename="../../gui/closing.py" />
            <source>Close without waiting</source>
            <translation>Schließen, ohne zu warten</translation>
        </message>
        <message>
            <location filename="../../gui/widgets.py" />
            <location filename="../../mass/dialog.py" />
            <location filename="../../preview/dialog.py" />
            <location filename="../../register/dialog.py" />
            <location filename="../../revisions/dialog.py" />
            <location filename="../../settings/install.py" />
            <source>Close</source>
            <translation>Schließen</translation>
        </message>
        <message>
            <location filename="../../mass/dialog.py" />
            <source>Mass of {name}</source>
            <translation>Masse von {name}</translation>
        </message>
        <message>
            <location filename="../../mass/dialog.py" />
            <source>Copy the table, for a spreadsheet</source>
            <translation>Die Tabelle kopieren, für eine Tabellenkalkulation</translation>
        </message>
        <message>
            <location filename="../../mass/dialog.py" />
            <source>Copy</source>
            <translation>Kopieren</translation>
        </message>
        <message>
            <location filename="../../mass/dialog.py" />
            <location filename="../../register/rows.py" />
            <source>Part</source>
            <translation>Teil</translation>
        </message>
        <message>
            <location filename="../../mass/dialog.py" />
            <source>Quantity</source>
            <translation>Menge</translation>
        </message>
        <message>
            <location filename="../../mass/dialog.py" />
            <source>Mass of one</source>
            <translation>Masse je Stück</translation>
        </message>
        <message>
            <location filename="../../mass/dialog.py" />
            <source>Mass</source>
            <translation>Masse</translation>
        </message>
        <message>
            <location filename="../../mass/dialog.py" />
            <source>Volume of one, cm³</source>
            <translation>Volumen je Stück, cm³</translation>
        </message>
        <message>
            <location filename="../../mass/dialog.py" />
            <source>Material</source>
            <translation>Werkstoff</translation>
        </message>
        <message>
            <location filename="../../mass/dialog.py" />
            <location filename="../../register/dialog.py" />
            <source>Remarks</source>
            <translation>Bemerkungen</translation>
        </message>
        <message>
            <location filename="../../mass/flow.py" />
            <source>Mass of the assembly</source>
            <translation>Masse der Baugruppe</translation>
        </message>
        <message>
            <location filename="../../mass/flow.py" />
            <source>This FreeCAD's Python has no numpy, which masses need.</source>
            <translation>Dem Python dieses FreeCAD fehlt numpy, das für Massen nötig ist.</translation>
        </message>
        <message>
            <location filename="../../mass/rows.py" />
            <source>1 part has no mass; it is missing from the sum.</source>
            <translation>1 Teil hat keine Masse; es fehlt in der Summe.</translation>
        </message>
        <message>
            <location filename="../../mass/rows.py" />
            <source>{n} parts have no mass; they are missing from the sum.</source>
            <translation>{n} Teile haben keine Masse; sie fehlen in der Summe.</translation>
        </message>
        <message>
            <location filename="../../mass/rows.py" />
            <source>No part of this assembly has a material with a density.</source>
            <translation>Kein Teil dieser Baugruppe hat einen Werkstoff mit Dichte.</translation>
        </message>
        <message>
            <location filename="../../mass/rows.py" />
            <source>{mass} in {pieces}, centre of mass at {x}, {y}, {z} mm</source>
            <translation>{mass} in {pieces}, Schwerpunkt bei {x}, {y}, {z} mm</translation>
        </message>
        <message>
            <location filename="../../mass/rows.py" />
            <source>1 piece</source>
            <translation>1 Stück</translation>
        </message>
        <message>
            <location filename="../../mass/rows.py" />
            <source>{n} pieces</source>
            <translation>{n} Stück</translation>
        </message>
        <message>
            <location filename="../../mass/rows.py" />
            <source>no material with a density</source>
            <translation>kein Werkstoff mit Dichte</translation>
        </message>
        <message>
            <location filename="../../mass/waiting.py" />
            <source>Measuring {name}</source>
            <translation>{name} wird gemessen</translation>
        </message>
        <message>
            <location filename="../../mass/waiting.py" />
            <source>Reading the assembly…</source>
            <translation>Baugruppe wird gelesen…</translation>
        </message>
        <message>
            <location filename="../../mass/waiting.py" />
            <source>Part {n} of {total}</source>
            <translation>Teil {n} von {total}</translation>
        </message>
        <message>
            <location filename="../../mass/waiting.py" />
            <source>face {n} of {total}</source>
            <translation>Fläche {n} von {total}</translation>
        </message>
        <message>
            <location filename="../../packages.py" />
            <source>Silo needs the Python packages {names}. Install them with silo-mod install-addon, or with: {command} – then start FreeCAD again.</source>
            <translation>Silo braucht die Python-Pakete {names}. Installieren Sie sie mit silo-mod install-addon oder mit: {command} – und starten Sie FreeCAD neu.</translation>
        </message>
        <message>
            <location filename="../../pane/banner.py" />
            <source>{who} committed {name} (revision {n}) since you opened it.</source>
            <translation>{who} hat {name} eingecheckt (Revision {n}), seit Sie geöffnet haben.</translation>
        </message>
        <message>
            <location filename="../../pane/banner.py" />
            <location filename="../../pane/boxes.py" />
            <location filename="../../preview/flow.py" />
            <source>… and {n} more</source>
            <translation>… und {n} weitere</translation>
        </message>
        <message>
            <location filename="../../pane/banner.py" />
            <source>Settings…</source>
            <translation>Einstellungen…</translation>
        </message>
        <message>
            <location filename="../../pane/banner.py" />
            <location filename="../../settings/install.py" />
            <source>Try again</source>
            <translation>Noch einmal versuchen</translation>
        </message>
        <message>
            <location filename="../../pane/banner.py" />
            <location filename="../../settings/install.py" />
            <source>Install What Silo Needs…</source>
            <translation>Installieren, was Silo braucht…</translation>
        </message>
        <message>
            <location filename="../../pane/banner.py" />
            <source>No Silo server is set up yet.</source>
            <translation>Noch ist kein Silo-Server eingerichtet.</translation>
        </message>
        <message>
            <location filename="../../pane/banner.py" />
            <source>Connected to {host}</source>
            <translation>Verbunden mit {host}</translation>
        </message>
        <message>
            <location filename="../../pane/banner.py" />
            <source>{host} is read-only now. Commits wait here until it takes changes again.</source>
            <translation>{host} nimmt zurzeit keine Änderungen an. Eingechecktes wartet hier so lange.</translation>
        </message>
        <message>
            <location filename="../../pane/banner.py" />
            <source>{host} works only in part. What cannot be sent waits here.</source>
            <translation>{host} arbeitet nur teilweise. Was nicht gesendet werden kann, wartet hier.</translation>
        </message>
        <message>
            <location filename="../../pane/banner.py" />
            <source>No connection to {host}. Commits wait here and are sent later.</source>
            <translation>Keine Verbindung zu {host}. Eingechecktes wartet hier und wird später gesendet.</translation>
        </message>
        <message>
            <location filename="../../pane/banner.py" />
            <source>{host} does not accept the token.</source>
            <translation>{host} nimmt das Token nicht an.</translation>
        </message>
        <message>
            <location filename="../../pane/banner.py" />
            <source>Connecting to {host}…</source>
            <translation>Verbindung zu {host} wird aufgebaut…</translation>
        </message>
        <message>
            <location filename="../../pane/banner.py" />
            <source>{host} sends no live events; what you commit is shown anyway.</source>
            <translation>{host} meldet nichts live; was Sie einchecken, wird trotzdem angezeigt.</translation>
        </message>
        <message>
            <location filename="../../pane/banner.py" />
            <source>Live events need the package sseclient-py. What you commit is shown without it, too.</source>
            <translation>Live-Meldungen brauchen das Paket sseclient-py. Was Sie einchecken, wird auch ohne es angezeigt.</translation>
        </message>
        <message>
            <location filename="../../pane/banner.py" />
            <source>{host} (live events are off)</source>
            <translation>{host} (Live-Meldungen sind aus)</translation>
        </message>
        <message>
            <location filename="../../pane/boxes.py" />
            <source>Nothing has happened yet. Commit an assembly with File → Commit to Silo, and follow it here.</source>
            <translation>Noch ist nichts geschehen. Checken Sie eine Baugruppe mit Datei → In Silo einchecken ein; was daraus wird, steht dann hier.</translation>
        </message>
        <message>
            <location filename="../../pane/boxes.py" />
            <source>Show older…</source>
            <translation>Ältere zeigen…</translation>
        </message>
        <message>
            <location filename="../../pane/boxes.py" />
            <source>Stop</source>
            <translation>Anhalten</translation>
        </message>
        <message>
            <location filename="../../pane/boxes.py" />
            <source>Retry all</source>
            <translation>Alle wiederholen</translation>
        </message>
        <message>
            <location filename="../../pane/boxes.py" />
            <source>Send now</source>
            <translation>Jetzt senden</translation>
        </message>
        <message>
            <location filename="../../pane/boxes.py" />
            <source>Send all {n} commits for another address to {host}</source>
            <translation>Alle {n} einer anderen Adresse an {host} senden</translation>
        </message>
        <message>
            <location filename="../../pane/dock.py" />
            <location filename="../../settings/install.py" />
            <source>Database Activity</source>
            <translation>Datenbank-Aktivität</translation>
        </message>
        <message>
            <location filename="../../pane/status_sign.py" />
            <source>{n} BOM held</source>
            <translation>{n} Stückliste zurückgehalten</translation>
        </message>
        <message>
            <location filename="../../pane/status_sign.py" />
            <source>{n} BOMs held</source>
            <translation>{n} Stücklisten zurückgehalten</translation>
        </message>
        <message>
            <location filename="../../pane/status_sign.py" />
            <source>{n} commit asks</source>
            <translation>{n} Commit fragt</translation>
        </message>
        <message>
            <location filename="../../pane/status_sign.py" />
            <source>{n} commits ask</source>
            <translation>{n} Commits fragen</translation>
        </message>
        <message>
            <location filename="../../pane/waiting.py" />
            <source>{n} thing waits to be sent</source>
            <translation>{n} Eintrag wartet auf das Senden</translation>
        </message>
        <message>
            <location filename="../../pane/waiting.py" />
            <source>{n} things wait to be sent</source>
            <translation>{n} Einträge warten auf das Senden</translation>
        </message>
        <message>
            <location filename="../../pane/waiting.py" />
            <source>{n} thing waits for your choice</source>
            <translation>{n} Eintrag wartet auf Ihre Entscheidung</translation>
        </message>
        <message>
            <location filename="../../pane/waiting.py" />
            <source>{n} things wait for your choice</source>
            <translation>{n} Einträge warten auf Ihre Entscheidung</translation>
        </message>
        <message>
            <location filename="../../pane/waiting.py" />
            <source>, {urgent} of them for your choice</source>
            <translation>, {urgent} davon auf Ihre Entscheidung</translation>
        </message>
        <message>
            <location filename="../../pane/waiting.py" />
            <location filename="../../../outbox/status_text.py" />
            <source>BOM</source>
            <translation>Stückliste</translation>
        </message>
        <message>
            <location filename="../../pane/waiting.py" />
            <source>held: {why}</source>
            <translation>zurückgehalten: {why}</translation>
        </message>
        <message>
            <location filename="../../pane/waiting.py" />
            <source>Sync without what is missing</source>
            <translation>Ohne das Fehlende abgleichen</translation>
        </message>
        <message>
            <location filename="../../pane/waiting.py" />
            <source>{n} BOM is held: Silo has the file, and the BOM of before</source>
            <translation>{n} Stückliste wird zurückgehalten: Silo hat die Datei und die Stückliste von davor</translation>
        </message>
        <message>
            <location filename="../../pane/waiting.py" />
            <source>{n} BOMs are held: Silo has the files, and the BOMs of before</source>
            <translation>{n} Stücklisten werden zurückgehalten: Silo hat die Dateien und die Stücklisten von davor</translation>
        </message>
        <message>
            <location filename="../../pane/waiting.py" />
            <source>Send to {host}</source>
            <translation>An {host} senden</translation>
        </message>
        <message>
            <location filename="../../pane/waiting.py" />
            <source>Retry</source>
            <translation>Wiederholen</translation>
        </message>
        <message>
            <location filename="../../pane/waiting.py" />
            <source>Open theirs beside mine</source>
            <translation>Fremde daneben öffnen</translation>
        </message>
        <message>
            <location filename="../../pane/waiting.py" />
            <source>Compare with revision {n}</source>
            <translation>Mit Revision {n} vergleichen</translation>
        </message>
        <message>
            <location filename="../../pane/waiting.py" />
            <source>Take theirs</source>
            <translation>Fremde übernehmen</translation>
        </message>
        <message>
            <location filename="../../pane/waiting.py" />
            <source>Commit mine on top</source>
            <translation>Meine darüber einchecken</translation>
        </message>
        <message>
            <location filename="../../pane/waiting.py" />
            <source>Save a copy…</source>
            <translation>Kopie speichern…</translation>
        </message>
        <message>
            <location filename="../../pane/waiting.py" />
            <source>Discard</source>
            <translation>Verwerfen</translation>
        </message>
        <message>
            <location filename="../../preview/dialog.py" />
            <source>BOM in Silo: {name}</source>
            <translation>Stückliste in Silo: {name}</translation>
        </message>
        <message>
            <location filename="../../preview/dialog.py" />
            <source>Comparing with Silo…</source>
            <translation>Vergleich mit Silo läuft…</translation>
        </message>
        <message>
            <location filename="../../preview/dialog.py" />
            <location filename="../../register/dialog.py" />
            <location filename="../../revisions/dialog.py" />
            <source>Part number</source>
            <translation>Teilenummer</translation>
        </message>
        <message>
            <location filename="../../preview/dialog.py" />
            <location filename="../../register/dialog.py" />
            <location filename="../../revisions/dialog.py" />
            <source>Name</source>
            <translation>Name</translation>
        </message>
        <message>
            <location filename="../../preview/dialog.py" />
            <location filename="../../register/rows.py" />
            <source>Assembly</source>
            <translation>Baugruppe</translation>
        </message>
        <message>
            <location filename="../../preview/dialog.py" />
            <location filename="../../revisions/dialog.py" />
            <source>In Silo</source>
            <translation>In Silo</translation>
        </message>
        <message>
            <location filename="../../preview/dialog.py" />
            <source>What a sync does</source>
            <translation>Was ein Abgleich tut</translation>
        </message>
        <message>
            <location filename="../../preview/dialog.py" />
            <source>Show only lines that differ</source>
            <translation>Nur Positionen zeigen, die abweichen</translation>
        </message>
        <message>
            <location filename="../../preview/dialog.py" />
            <source>Sync although links are broken (the lines that they stand for stay as they are)</source>
            <translation>Trotz defekter Verknüpfungen abgleichen (deren Positionen bleiben, wie sie sind)</translation>
        </message>
        <message>
            <location filename="../../preview/dialog.py" />
            <source>Select the instances in the 3D view and the tree</source>
            <translation>Die Instanzen in der 3D-Ansicht und im Baum auswählen</translation>
        </message>
        <message>
            <location filename="../../preview/dialog.py" />
            <source>Why so many?</source>
            <translation>Warum so viele?</translation>
        </message>
        <message>
            <location filename="../../preview/dialog.py" />
            <source>Show each chain of links and arrays from the assembly to the part</source>
            <translation>Jede Kette von Verknüpfungen und Anordnungen von der Baugruppe bis zum Teil zeigen</translation>
        </message>
        <message>
            <location filename="../../preview/dialog.py" />
            <source>Count It</source>
            <translation>Mitzählen</translation>
        </message>
        <message>
            <location filename="../../preview/dialog.py" />
            <source>Count the hidden objects of the selected row; the file keeps that</source>
            <translation>Die ausgeblendeten Objekte der gewählten Zeile mitzählen; die Datei behält das</translation>
        </message>
        <message>
            <location filename="../../preview/dialog.py" />
            <source>Reference</source>
            <translation>Referenz</translation>
        </message>
        <message>
            <location filename="../../preview/dialog.py" />
            <source>The hidden objects of the selected row count nowhere; the file keeps that</source>
            <translation>Die ausgeblendeten Objekte der gewählten Zeile zählen nirgends; die Datei behält das</translation>
        </message>
        <message>
            <location filename="../../preview/dialog.py" />
            <source>Compare again</source>
            <translation>Neu vergleichen</translation>
        </message>
        <message>
            <location filename="../../preview/dialog.py" />
            <source>Compare with 3D view</source>
            <translation>Mit 3D-Ansicht vergleichen</translation>
        </message>
        <message>
            <location filename="../../preview/dialog.py" />
            <source>Check that the BOM explains each solid in 3D, and select any other solid</source>
            <translation>Erklärt die Stückliste jeden Körper, den FreeCAD zeigt? Wählt aus, was sie nicht erklärt</translation>
        </message>
        <message>
            <location filename="../../preview/dialog.py" />
            <source>Mend links</source>
            <translation>Verknüpfungen reparieren</translation>
        </message>
        <message>
            <location filename="../../preview/dialog.py" />
            <source>Sync</source>
            <translation>Abgleichen</translation>
        </message>
        <message>
            <location filename="../../preview/dialog.py" />
            <source>Sync the {n} sub-assembly that differs too, before this one</source>
            <translation>Zuvor auch die {n} abweichende Unterbaugruppe abgleichen</translation>
        </message>
        <message>
            <location filename="../../preview/dialog.py" />
            <source>Sync the {n} sub-assemblies that differ too, before this one</source>
            <translation>Zuvor auch die {n} abweichenden Unterbaugruppen abgleichen</translation>
        </message>
        <message>
            <location filename="../../preview/dialog.py" />
            <source>This assembly has no Silo part number yet. Register it to sync its BOM.</source>
            <translation>Diese Baugruppe hat noch keine Silo-Teilenummer. Registrieren Sie sie, um ihre Stückliste abzugleichen.</translation>
        </message>
        <message>
            <location filename="../../preview/dialog.py" />
            <source>{n} broken link: the BOM is not synced until it is mended.</source>
            <translation>{n} defekte Verknüpfung: Die Stückliste wird erst abgeglichen, wenn sie repariert ist.</translation>
        </message>
        <message>
            <location filename="../../preview/dialog.py" />
            <source>{n} broken links: the BOM is not synced until they are mended.</source>
            <translation>{n} defekte Verknüpfungen: Die Stückliste wird erst abgeglichen, wenn sie repariert sind.</translation>
        </message>
        <message>
            <location filename="../../preview/dialog.py" />
            <source>… and {n} more rows</source>
            <translation>… und {n} weitere Zeilen</translation>
        </message>
        <message>
            <location filename="../../preview/flow.py" />
            <source>{name} holds no assembly, so it has no BOM.</source>
            <translation>{name} enthält keine Baugruppe, also keine Stückliste.</translation>
        </message>
        <message>
            <location filename="../../preview/flow.py" />
            <source>BOM in Silo</source>
            <translation>Stückliste in Silo</translation>
        </message>
        <message>
            <location filename="../../preview/flow.py" />
            <source>{name} is not open any more. Open it, then compare again.</source>
            <translation>{name} ist nicht mehr offen. Bitte öffnen und neu vergleichen.</translation>
        </message>
        <message>
            <location filename="../../preview/flow.py" />
            <location filename="../../session/session.py" />
            <source>Comparing with Silo</source>
            <translation>Vergleich mit Silo</translation>
        </message>
        <message>
            <location filename="../../preview/flow.py" />
            <source>Counted from now on: {names}. Save the file to keep that.</source>
            <translation>Zählt ab jetzt: {names}. Speichern Sie die Datei, damit es so bleibt.</translation>
        </message>
        <message>
            <location filename="../../preview/flow.py" />
            <source>References from now on, not counted: {names}. Save the file to keep that.</source>
            <translation>Ab jetzt Referenzen, nicht gezählt: {names}. Speichern Sie die Datei, damit es so bleibt.</translation>
        </message>
        <message>
            <location filename="../../preview/flow.py" />
            <source>Nothing was synced: {name} was edited since the comparison. Here it is now.</source>
            <translation>Nichts wurde abgeglichen: {name} wurde seit dem Vergleich geändert. So ist der Stand jetzt.</translation>
        </message>
        <message>
            <location filename="../../preview/rows.py" />
            <source>Without a part number: left out until registered</source>
            <translation>Ohne Teilenummer: fehlt bis zur Registrierung</translation>
        </message>
        <message>
            <location filename="../../preview/rows.py" />
            <source>Modelled in this file: no items yet, never sent</source>
            <translation>In dieser Datei modelliert: noch keine Artikel, wird nie gesendet</translation>
        </message>
        <message>
            <location filename="../../preview/rows.py" />
            <source>Not counted, or counted with a remark</source>
            <translation>Nicht gezählt, oder mit einer Bemerkung gezählt</translation>
        </message>
        <message>
            <location filename="../../preview/rows.py" />
            <source>with variants: {values}</source>
            <translation>mit Varianten: {values}</translation>
        </message>
        <message>
            <location filename="../../preview/rows.py" />
            <source>missing: {file}</source>
            <translation>fehlt: {file}</translation>
        </message>
        <message>
            <location filename="../../preview/rows.py" />
            <source>… more rows than can be shown here</source>
            <translation>… mehr Zeilen, als hier gezeigt werden können</translation>
        </message>
        <message>
            <location filename="../../preview/rows.py" />
            <source>new in the assembly: will be added</source>
            <translation>neu in der Baugruppe: kommt hinzu</translation>
        </message>
        <message>
            <location filename="../../preview/rows.py" />
            <source>will take the assembly's quantity</source>
            <translation>erhält die Menge der Baugruppe</translation>
        </message>
        <message>
            <location filename="../../preview/rows.py" />
            <source>manual line in Silo with another quantity: a reviewer decides there</source>
            <translation>manuelle Position in Silo mit anderer Menge: dort entscheidet ein Mensch</translation>
        </message>
        <message>
            <location filename="../../preview/rows.py" />
            <source>not in the assembly: kept, marked unreferenced</source>
            <translation>nicht in der Baugruppe: bleibt, als nicht verwendet markiert</translation>
        </message>
        <message>
            <location filename="../../preview/rows.py" />
            <source>manual line: not touched</source>
            <translation>manuelle Position: bleibt unberührt</translation>
        </message>
        <message>
            <location filename="../../preview/rows.py" />
            <source>its file is missing: the line stays as it is</source>
            <translation>ihre Datei fehlt: die Position bleibt, wie sie ist</translation>
        </message>
        <message>
            <location filename="../../preview/rows.py" />
            <source>its own BOM is not in Silo yet</source>
            <translation>ihre eigene Stückliste ist noch nicht in Silo</translation>
        </message>
        <message>
            <location filename="../../preview/rows.py" />
            <source>its own BOM differs from Silo</source>
            <translation>ihre eigene Stückliste weicht von Silo ab</translation>
        </message>
        <message>
            <location filename="../../preview/rows.py" />
            <source>hidden, counts</source>
            <translation>ausgeblendet, zählt</translation>
        </message>
        <message>
            <location filename="../../preview/rows.py" />
            <source>hidden, does not count</source>
            <translation>ausgeblendet, zählt nicht</translation>
        </message>
        <message>
            <location filename="../../preview/rows.py" />
            <source>hidden, only a reference: does not count</source>
            <translation>ausgeblendet, nur eine Referenz: zählt nicht</translation>
        </message>
        <message>
            <location filename="../../preview/rows.py" />
            <source>{n} to add</source>
            <translation>{n} neu</translation>
        </message>
        <message>
            <location filename="../../preview/rows.py" />
            <source>{n} with another quantity</source>
            <translation>{n} mit anderer Menge</translation>
        </message>
        <message>
            <location filename="../../preview/rows.py" />
            <source>{n} unreferenced</source>
            <translation>{n} nicht verwendet</translation>
        </message>
        <message>
            <location filename="../../preview/rows.py" />
            <source>{n} in conflict</source>
            <translation>{n} im Konflikt</translation>
        </message>
        <message>
            <location filename="../../preview/rows.py" />
            <source>{n} without a part number</source>
            <translation>{n} ohne Teilenummer</translation>
        </message>
        <message>
            <location filename="../../preview/rows.py" />
            <source>{n} missing</source>
            <translation>{n} fehlend</translation>
        </message>
        <message>
            <location filename="../../preview/rows.py" />
            <source>{n} sub-assembly is not in Silo yet</source>
            <translation>{n} Unterbaugruppe ist noch nicht in Silo</translation>
        </message>
        <message>
            <location filename="../../preview/rows.py" />
            <source>{n} sub-assemblies are not in Silo yet</source>
            <translation>{n} Unterbaugruppen sind noch nicht in Silo</translation>
        </message>
        <message>
            <location filename="../../preview/rows.py" />
            <source>{n} sub-assembly differs from Silo</source>
            <translation>{n} Unterbaugruppe weicht von Silo ab</translation>
        </message>
        <message>
            <location filename="../../preview/rows.py" />
            <source>{n} sub-assemblies differ from Silo</source>
            <translation>{n} Unterbaugruppen weichen von Silo ab</translation>
        </message>
        <message>
            <location filename="../../preview/rows.py" />
            <source>{n} line agrees</source>
            <translation>{n} Position stimmt überein</translation>
        </message>
        <message>
            <location filename="../../preview/rows.py" />
            <source>{n} lines agree</source>
            <translation>{n} Positionen stimmen überein</translation>
        </message>
        <message>
            <location filename="../../preview/rows.py" />
            <source>Nothing to sync: all {n} lines agree with Silo.</source>
            <translation>Nichts abzugleichen: Alle {n} Positionen stimmen mit Silo überein.</translation>
        </message>
        <message>
            <location filename="../../register/dialog.py" />
            <location filename="../../register/flow.py" />
            <source>Register Components</source>
            <translation>Komponenten registrieren</translation>
        </message>
        <message>
            <location filename="../../register/dialog.py" />
            <source>Looking for components without a part number…</source>
            <translation>Komponenten ohne Teilenummer werden gesucht…</translation>
        </message>
        <message>
            <location filename="../../register/dialog.py" />
            <source>Component</source>
            <translation>Komponente</translation>
        </message>
        <message>
            <location filename="../../register/dialog.py" />
            <source>Source</source>
            <translation>Herkunft</translation>
        </message>
        <message>
            <location filename="../../register/dialog.py" />
            <source>Supplier</source>
            <translation>Lieferant</translation>
        </message>
        <message>
            <location filename="../../register/dialog.py" />
            <source>Supplier's number</source>
            <translation>Nummer beim Lieferanten</translation>
        </message>
        <message>
            <location filename="../../register/dialog.py" />
            <source>Type</source>
            <translation>Art</translation>
        </message>
        <message>
            <location filename="../../register/dialog.py" />
            <source>Category</source>
            <translation>Kategorie</translation>
        </message>
        <message>
            <location filename="../../register/dialog.py" />
            <source>Filter</source>
            <translation>Filter</translation>
        </message>
        <message>
            <location filename="../../register/dialog.py" />
            <source>Check All</source>
            <translation>Alle</translation>
        </message>
        <message>
            <location filename="../../register/dialog.py" />
            <source>None</source>
            <translation>Keine</translation>
        </message>
        <message>
            <location filename="../../register/dialog.py" />
            <source>All Certain</source>
            <translation>Alle sicheren</translation>
        </message>
        <message>
            <location filename="../../register/dialog.py" />
            <source>Source…</source>
            <translation>Herkunft…</translation>
        </message>
        <message>
            <location filename="../../register/dialog.py" />
            <source>Category…</source>
            <translation>Kategorie…</translation>
        </message>
        <message>
            <location filename="../../register/dialog.py" />
            <source>Type…</source>
            <translation>Art…</translation>
        </message>
        <message>
            <location filename="../../register/dialog.py" />
            <source>Supplier…</source>
            <translation>Lieferant…</translation>
        </message>
        <message>
            <location filename="../../register/dialog.py" />
            <source>Name, as {name} left {n}</source>
            <translation>Name: {name} {n}</translation>
        </message>
        <message>
            <location filename="../../register/dialog.py" />
            <source>Fill Down</source>
            <translation>Nach unten füllen</translation>
        </message>
        <message>
            <location filename="../../register/dialog.py" />
            <source>All chosen rows get what the first of them has in this column (Ctrl+D)</source>
            <translation>Alle gewählten Zeilen erhalten, was die erste von ihnen in dieser Spalte hat (Strg+D)</translation>
        </message>
        <message>
            <location filename="../../register/dialog.py" />
            <source>For the chosen rows:</source>
            <translation>Für die gewählten Zeilen:</translation>
        </message>
        <message>
            <location filename="../../register/dialog.py" />
            <source>Ask after each commit</source>
            <translation>Nach jedem Einchecken fragen</translation>
        </message>
        <message>
            <location filename="../../register/dialog.py" />
            <source>Register Selected</source>
            <translation>Gewählte registrieren</translation>
        </message>
        <message>
            <location filename="../../register/dialog.py" />
            <source>Undo</source>
            <translation>Rückgängig</translation>
        </message>
        <message>
            <location filename="../../register/dialog.py" />
            <source>Undo the last registration: archive the new items and remove them from the files</source>
            <translation>Nimmt die letzte Registrierung zurück: Neue Artikel werden archiviert, die Dateien vergessen sie</translation>
        </message>
        <message>
            <location filename="../../register/dialog.py" />
            <source>Skip All</source>
            <translation>Alle überspringen</translation>
        </message>
        <message>
            <location filename="../../register/dialog.py" />
            <source>Register</source>
            <translation>Registrieren</translation>
        </message>
        <message>
            <location filename="../../register/dialog.py" />
            <source>Not listed again, here or on the command line; the file keeps this choice</source>
            <translation>Es wird nicht mehr aufgeführt, weder hier noch auf der Befehlszeile; die Datei merkt sich das</translation>
        </message>
        <message>
            <location filename="../../register/dialog.py" />
            <source>Not a Part</source>
            <translation>Kein Teil</translation>
        </message>
        <message>
            <location filename="../../register/dialog.py" />
            <source>guess: {category}</source>
            <translation>geraten: {category}</translation>
        </message>
        <message>
            <location filename="../../register/dialog.py" />
            <source>Keep</source>
            <translation>Behalten</translation>
        </message>
        <message>
            <location filename="../../register/dialog.py" />
            <source>Take Back</source>
            <translation>Zurücknehmen</translation>
        </message>
        <message>
            <location filename="../../register/dialog.py" />
            <source>Undeclare</source>
            <translation>Nicht mehr zählen</translation>
        </message>
        <message>
            <location filename="../../register/dialog.py" />
            <source>Declare</source>
            <translation>Als Teil zählen</translation>
        </message>
        <message>
            <location filename="../../register/flow.py" />
            <source>Looking for components without a part number</source>
            <translation>Komponenten ohne Teilenummer werden gesucht</translation>
        </message>
        <message>
            <location filename="../../register/flow.py" />
            <source>Reading pictures</source>
            <translation>Bilder werden gelesen</translation>
        </message>
        <message>
            <location filename="../../register/flow.py" />
            <source>Asking for the next number</source>
            <translation>Die nächste Nummer wird erfragt</translation>
        </message>
        <message>
            <location filename="../../register/flow.py" />
            <source>Registering</source>
            <translation>Registrierung läuft</translation>
        </message>
        <message>
            <location filename="../../register/flow.py" />
            <source>Undoing</source>
            <translation>Registrierung wird zurückgenommen</translation>
        </message>
        <message>
            <location filename="../../register/flow.py" />
            <source>Registered</source>
            <translation>Registriert</translation>
        </message>
        <message>
            <location filename="../../register/rows.py" />
            <source>Components</source>
            <translation>Komponenten</translation>
        </message>
        <message>
            <location filename="../../register/rows.py" />
            <source>Standard parts</source>
            <translation>Normteile</translation>
        </message>
        <message>
            <location filename="../../register/rows.py" />
            <source>Modelled in this file, not counted</source>
            <translation>In dieser Datei modelliert, nicht gezählt</translation>
        </message>
        <message>
            <location filename="../../register/rows.py" />
            <source>Modelled in this file, and counted</source>
            <translation>In dieser Datei modelliert und gezählt</translation>
        </message>
        <message>
            <location filename="../../register/rows.py" />
            <source>Modelled in this file, not a part</source>
            <translation>In dieser Datei modelliert und kein Teil</translation>
        </message>
        <message>
            <location filename="../../register/rows.py" />
            <source>Configured copies of parts</source>
            <translation>Konfigurierte Kopien von Teilen</translation>
        </message>
        <message>
            <location filename="../../register/rows.py" />
            <source>Consumable</source>
            <translation>Verbrauchsmaterial</translation>
        </message>
        <message>
            <location filename="../../register/rows.py" />
            <source>Tool</source>
            <translation>Werkzeug</translation>
        </message>
        <message>
            <location filename="../../register/rows.py" />
            <source>made here</source>
            <translation>selbst gefertigt</translation>
        </message>
        <message>
            <location filename="../../register/rows.py" />
            <source>bought</source>
            <translation>gekauft</translation>
        </message>
        <message>
            <location filename="../../register/rows.py" />
            <source>not stated</source>
            <translation>offen</translation>
        </message>
        <message>
            <location filename="../../register/rows.py" />
            <source>all rows</source>
            <translation>alle Zeilen</translation>
        </message>
        <message>
            <location filename="../../register/rows.py" />
            <source>unsure</source>
            <translation>unsichere</translation>
        </message>
        <message>
            <location filename="../../register/rows.py" />
            <source>new</source>
            <translation>neue</translation>
        </message>
        <message>
            <location filename="../../register/rows.py" />
            <source>probable duplicates</source>
            <translation>mögliche Dubletten</translation>
        </message>
        <message>
            <location filename="../../register/rows.py" />
            <source>its unsaved edits are saved too</source>
            <translation>ungespeicherte Änderungen werden mit gespeichert</translation>
        </message>
        <message>
            <location filename="../../register/rows.py" />
            <source>open in another FreeCAD: close it there first, or saving there undoes this</source>
            <translation>in einem anderen FreeCAD offen: zuerst dort schließen, sonst macht Speichern dort dies rückgängig</translation>
        </message>
        <message>
            <location filename="../../register/rows.py" />
            <source>the file is read-only</source>
            <translation>die Datei ist schreibgeschützt</translation>
        </message>
        <message>
            <location filename="../../register/rows.py" />
            <source>has edits, but is loaded only in part: open the file itself first</source>
            <translation>hat Änderungen, ist aber nur teilweise geladen: zuerst die Datei selbst öffnen</translation>
        </message>
        <message>
            <location filename="../../register/rows.py" />
            <source>has changed on disk since you opened it: open it again first</source>
            <translation>wurde auf der Platte geändert, seit Sie geöffnet haben: zuerst neu öffnen</translation>
        </message>
        <message>
            <location filename="../../register/rows.py" />
            <source>the file is missing</source>
            <translation>die Datei fehlt</translation>
        </message>
        <message>
            <location filename="../../register/rows.py" />
            <source>has no file yet: save it first</source>
            <translation>hat noch keine Datei: zuerst speichern</translation>
        </message>
        <message>
            <location filename="../../register/rows.py" />
            <source>made by a newer FreeCAD: cannot be saved here</source>
            <translation>von einem neueren FreeCAD: kann hier nicht gespeichert werden</translation>
        </message>
        <message>
            <location filename="../../register/rows.py" />
            <source>Standard part: {name}</source>
            <translation>Normteil: {name}</translation>
        </message>
        <message>
            <location filename="../../register/rows.py" />
            <source>{name} ({n} copies)</source>
            <translation>{name} ({n} Kopien)</translation>
        </message>
        <message>
            <location filename="../../register/rows.py" />
            <source>{number} (kept)</source>
            <translation>{number} (bleibt)</translation>
        </message>
        <message>
            <location filename="../../register/rows.py" />
            <source>same or new part?</source>
            <translation>gleiches oder neues Teil?</translation>
        </message>
        <message>
            <location filename="../../register/rows.py" />
            <source>one for each</source>
            <translation>je eine</translation>
        </message>
        <message>
            <location filename="../../register/rows.py" />
            <source>{number} or later</source>
            <translation>{number} oder höher</translation>
        </message>
        <message>
            <location filename="../../register/rows.py" />
            <source>{number} (new)</source>
            <translation>{number} (neu)</translation>
        </message>
        <message>
            <location filename="../../register/rows.py" />
            <source>same part: keep {number}</source>
            <translation>gleiches Teil: {number} behalten</translation>
        </message>
        <message>
            <location filename="../../register/rows.py" />
            <source>new part: a new number</source>
            <translation>neues Teil: neue Nummer</translation>
        </message>
        <message>
            <location filename="../../register/rows.py" />
            <source>a new number</source>
            <translation>eine neue Nummer</translation>
        </message>
        <message>
            <location filename="../../register/rows.py" />
            <source>different parts: a number for each copy</source>
            <translation>verschiedene Teile: eine Nummer je Kopie</translation>
        </message>
        <message>
            <location filename="../../register/rows.py" />
            <source>stays as it is</source>
            <translation>bleibt, wie es ist</translation>
        </message>
        <message>
            <location filename="../../register/rows.py" />
            <source>registered</source>
            <translation>registriert</translation>
        </message>
        <message>
            <location filename="../../register/rows.py" />
            <source>registering…</source>
            <translation>wird registriert…</translation>
        </message>
        <message>
            <location filename="../../register/rows.py" />
            <source>as you chose in this folder before</source>
            <translation>wie zuvor von Ihnen in diesem Ordner gewählt</translation>
        </message>
        <message>
            <location filename="../../register/rows.py" />
            <source>not a part: not listed again</source>
            <translation>kein Teil: nichts fragt mehr danach</translation>
        </message>
        <message>
            <location filename="../../register/rows.py" />
            <source>counts as {name}; check it to give it a number of its own</source>
            <translation>zählt als {name}; anhaken, um eine eigene Nummer zu vergeben</translation>
        </message>
        <message>
            <location filename="../../register/rows.py" />
            <source>counts once</source>
            <translation>zählt einmal</translation>
        </message>
        <message>
            <location filename="../../register/rows.py" />
            <source>counts {n} times</source>
            <translation>zählt {n}-mal</translation>
        </message>
        <message>
            <location filename="../../register/rows.py" />
            <source>would count once; check it if it is a part</source>
            <translation>würde einmal zählen; anhaken, wenn es ein Teil ist</translation>
        </message>
        <message>
            <location filename="../../register/rows.py" />
            <source>would count {n} times; check it if it is a part</source>
            <translation>würde {n}-mal zählen; anhaken, wenn es ein Teil ist</translation>
        </message>
        <message>
            <location filename="../../register/rows.py" />
            <source>imported from {file}</source>
            <translation>importiert aus {file}</translation>
        </message>
        <message>
            <location filename="../../register/rows.py" />
            <source>equal by their labels only</source>
            <translation>gleich nur nach den Bezeichnungen</translation>
        </message>
        <message>
            <location filename="../../register/rows.py" />
            <source>carries the identity of {number}, as another file does</source>
            <translation>trägt die Identität von {number}, wie eine andere Datei</translation>
        </message>
        <message>
            <location filename="../../register/rows.py" />
            <source>registered at another server: it keeps its identity</source>
            <translation>auf einem anderen Server registriert: behält seine Identität</translation>
        </message>
        <message>
            <location filename="../../register/rows.py" />
            <source>the same content as {name}</source>
            <translation>gleicher Inhalt wie {name}</translation>
        </message>
        <message>
            <location filename="../../register/rows.py" />
            <source>Silo has this very file as {number}</source>
            <translation>Silo hat genau diese Datei als {number}</translation>
        </message>
        <message>
            <location filename="../../register/rows.py" />
            <source>Silo has {number} with the same name</source>
            <translation>Silo hat {number} mit gleichem Namen</translation>
        </message>
        <message>
            <location filename="../../register/rows.py" />
            <source>Silo was not searched for parts that look alike: {problem}</source>
            <translation>In Silo wurde nicht nach ähnlichen Teilen gesucht: {problem}</translation>
        </message>
        <message>
            <location filename="../../register/rows.py" />
            <source>All components of {name} have their Silo part number.</source>
            <translation>Alle Komponenten von {name} haben ihre Silo-Teilenummer.</translation>
        </message>
        <message>
            <location filename="../../register/rows.py" />
            <source>All of these have their part number now.</source>
            <translation>Alle diese haben nun ihre Teilenummer.</translation>
        </message>
        <message>
            <location filename="../../register/rows.py" />
            <source>Where files carry one identity, choose in the column Part number: the same part, or a new one?</source>
            <translation>Tragen Dateien dieselbe Identität, wählen Sie in der Spalte Teilenummer: das gleiche Teil oder ein neues?</translation>
        </message>
        <message>
            <location filename="../../register/rows.py" />
            <source>({n} more after these)</source>
            <translation>({n} weitere danach)</translation>
        </message>
        <message>
            <location filename="../../register/rows.py" />
            <source>The following component has no Silo part number and will be excluded from the BOM until registered:</source>
            <translation>Die folgende Komponente hat keine Silo-Teilenummer und fehlt in der Stückliste, bis sie registriert ist:</translation>
        </message>
        <message>
            <location filename="../../register/rows.py" />
            <source>The following components have no Silo part number and will be excluded from the BOM until registered:</source>
            <translation>Die folgenden Komponenten haben keine Silo-Teilenummer und fehlen in der Stückliste, bis sie registriert sind:</translation>
        </message>
        <message>
            <location filename="../../revisions/dialog.py" />
            <source>Revision</source>
            <translation>Revision</translation>
        </message>
        <message>
            <location filename="../../revisions/dialog.py" />
            <source>When</source>
            <translation>Wann</translation>
        </message>
        <message>
            <location filename="../../revisions/dialog.py" />
            <source>Who</source>
            <translation>Wer</translation>
        </message>
        <message>
            <location filename="../../revisions/dialog.py" />
            <source>Comment</source>
            <translation>Kommentar</translation>
        </message>
        <message>
            <location filename="../../revisions/dialog.py" />
            <source>newest</source>
            <translation>neueste</translation>
        </message>
        <message>
            <location filename="../../revisions/dialog.py" />
            <source>yours</source>
            <translation>Ihre</translation>
        </message>
        <message>
            <location filename="../../revisions/dialog.py" />
            <source>Fetching…</source>
            <translation>Wird geholt…</translation>
        </message>
        <message>
            <location filename="../../revisions/dialog.py" />
            <source>Opened.</source>
            <translation>Geöffnet.</translation>
        </message>
        <message>
            <location filename="../../revisions/dialog.py" />
            <source>Open from Silo</source>
            <translation>Aus Silo öffnen</translation>
        </message>
        <message>
            <location filename="../../revisions/dialog.py" />
            <source>Part number, name or description</source>
            <translation>Teilenummer, Name oder Beschreibung</translation>
        </message>
        <message>
            <location filename="../../revisions/dialog.py" />
            <source>Open</source>
            <translation>Öffnen</translation>
        </message>
        <message>
            <location filename="../../revisions/dialog.py" />
            <source>Fetch newer revisions from Silo</source>
            <translation>Holen, was in Silo neuer ist</translation>
        </message>
        <message>
            <location filename="../../revisions/dialog.py" />
            <source>Project folder:</source>
            <translation>Projektordner:</translation>
        </message>
        <message>
            <location filename="../../revisions/dialog.py" />
            <source>Loading…</source>
            <translation>Wird geladen…</translation>
        </message>
        <message>
            <location filename="../../revisions/dialog.py" />
            <source>Nothing found.</source>
            <translation>Nichts gefunden.</translation>
        </message>
        <message>
            <location filename="../../revisions/dialog.py" />
            <source>with the newest linked files</source>
            <translation>mit dem Neuesten von allem, was verknüpft ist</translation>
        </message>
        <message>
            <location filename="../../revisions/dialog.py" />
            <source>It has no file in Silo.</source>
            <translation>Es hat keine Datei in Silo.</translation>
        </message>
        <message>
            <location filename="../../revisions/dialog.py" />
            <source>Choose the project folder first.</source>
            <translation>Wählen Sie zuerst den Projektordner.</translation>
        </message>
        <message>
            <location filename="../../revisions/dialog.py" />
            <source>It is in the project already, and is open: {path}</source>
            <translation>Die Datei liegt schon im Projekt und ist offen: {path}</translation>
        </message>
        <message>
            <location filename="../../revisions/dialog.py" />
            <source>History of {name}</source>
            <translation>Verlauf von {name}</translation>
        </message>
        <message>
            <location filename="../../revisions/dialog.py" />
            <source>Get This Revision as a Copy…</source>
            <translation>Diese Revision als Kopie holen…</translation>
        </message>
        <message>
            <location filename="../../revisions/dialog.py" />
            <source>Show the revision as a ghost beside yours; once more removes it</source>
            <translation>Zeigt die Revision als Schatten neben Ihrer; noch einmal entfernt ihn</translation>
        </message>
        <message>
            <location filename="../../revisions/dialog.py" />
            <source>Compare in 3D</source>
            <translation>In 3D vergleichen</translation>
        </message>
        <message>
            <location filename="../../revisions/dialog.py" />
            <source>Asking Silo…</source>
            <translation>Silo wird gefragt…</translation>
        </message>
        <message>
            <location filename="../../revisions/dialog.py" />
            <source>Comparing…</source>
            <translation>Vergleich läuft…</translation>
        </message>
        <message>
            <location filename="../../revisions/dialog.py" />
            <source>BOM: {changes}</source>
            <translation>Stückliste: {changes}</translation>
        </message>
        <message>
            <location filename="../../revisions/dialog.py" />
            <source>No change of the BOM.</source>
            <translation>Stückliste unverändert.</translation>
        </message>
        <message>
            <location filename="../../revisions/dialog.py" />
            <source>Edited here, and newer in Silo</source>
            <translation>Hier geändert, und neuer in Silo</translation>
        </message>
        <message>
            <location filename="../../revisions/dialog.py" />
            <source>What to do</source>
            <translation>Was tun</translation>
        </message>
        <message>
            <location filename="../../revisions/dialog.py" />
            <source>Do It</source>
            <translation>Ausführen</translation>
        </message>
        <message>
            <location filename="../../revisions/dialog.py" />
            <source>Choose the project's folder</source>
            <translation>Projektordner wählen</translation>
        </message>
        <message>
            <location filename="../../revisions/dialog.py" />
            <source>Refresh</source>
            <translation>Aktualisieren</translation>
        </message>
        <message>
            <location filename="../../revisions/dialog.py" />
            <source>Search</source>
            <translation>Suchen</translation>
        </message>
        <message>
            <location filename="../../revisions/dialog.py" />
            <source>Different from Silo</source>
            <translation>Nicht wie hier in Silo</translation>
        </message>
        <message>
            <location filename="../../revisions/dialog.py" />
            <source>Decide…</source>
            <translation>Entscheiden…</translation>
        </message>
        <message>
            <location filename="../../revisions/dialog.py" />
            <source>Commit All</source>
            <translation>Alle einchecken</translation>
        </message>
        <message>
            <location filename="../../revisions/dialog.py" />
            <source>Looking at the files…</source>
            <translation>Dateien werden geprüft…</translation>
        </message>
        <message>
            <location filename="../../revisions/dialog.py" />
            <source>Choose the project's folder: it is remembered, and marked as a project.</source>
            <translation>Wählen Sie den Projektordner: Er wird gemerkt und für andere markiert.</translation>
        </message>
        <message>
            <location filename="../../revisions/dialog.py" />
            <source>Silo: {state}</source>
            <translation>Silo: {state}</translation>
        </message>
        <message>
            <location filename="../../revisions/dialog.py" />
            <source>Choose a folder</source>
            <translation>Ordner wählen</translation>
        </message>
        <message>
            <location filename="../../revisions/dock.py" />
            <source>Silo Project</source>
            <translation>Silo-Projekt</translation>
        </message>
        <message>
            <location filename="../../revisions/flow.py" />
            <source>Silo has no model of revision {n} yet.</source>
            <translation>Silo hat noch kein Modell von Revision {n}.</translation>
        </message>
        <message>
            <location filename="../../revisions/flow.py" />
            <source>Fetching from Silo</source>
            <translation>Wird aus Silo geholt</translation>
        </message>
        <message>
            <location filename="../../revisions/flow.py" />
            <source>Yours is kept for {n} days at {path}</source>
            <translation>Ihre Fassung wird {n} Tage aufbewahrt: {path}</translation>
        </message>
        <message>
            <location filename="../../revisions/flow.py" />
            <source>It links to {names}, not in this folder: Open from Silo… fetches them.</source>
            <translation>Verknüpft ist {names}, nicht in diesem Ordner: „Aus Silo öffnen…“ holt es.</translation>
        </message>
        <message>
            <location filename="../../revisions/flow.py" />
            <source>Took {who}'s revision {n}: {name}</source>
            <translation>Revision {n} von {who} übernommen: {name}</translation>
        </message>
        <message>
            <location filename="../../revisions/flow.py" />
            <source>Took the file on disk: {name}</source>
            <translation>Datei auf der Platte übernommen: {name}</translation>
        </message>
        <message>
            <location filename="../../revisions/flow.py" />
            <source>Not fetched: {name}</source>
            <translation>Nicht geholt: {name}</translation>
        </message>
        <message>
            <location filename="../../revisions/flow.py" />
            <source>Searching</source>
            <translation>Suche läuft</translation>
        </message>
        <message>
            <location filename="../../revisions/flow.py" />
            <source>Asking Silo</source>
            <translation>Silo wird gefragt</translation>
        </message>
        <message>
            <location filename="../../revisions/flow.py" />
            <source>This server does not know the item of this document.</source>
            <translation>Dieser Server kennt den Artikel dieses Dokuments nicht.</translation>
        </message>
        <message>
            <location filename="../../revisions/flow.py" />
            <source>Comparing revisions</source>
            <translation>Revisionen werden verglichen</translation>
        </message>
        <message>
            <location filename="../../revisions/ghosts.py" />
            <source>The ghost is removed.</source>
            <translation>Der Schatten ist entfernt.</translation>
        </message>
        <message>
            <location filename="../../revisions/ghosts.py" />
            <source>Ghost: {removed} only in revision {n}, {moved} elsewhere there. Only here: {added}.</source>
            <translation>Schatten: {removed} nur in Revision {n}, {moved} dort an anderer Stelle. Nur hier: {added}.</translation>
        </message>
        <message>
            <location filename="../../revisions/ghosts.py" />
            <source>Not compared: {unknown} in groups and arrays without links.</source>
            <translation>Nicht verglichen: {unknown} in Gruppen und Anordnungen ohne Verknüpfungen.</translation>
        </message>
        <message>
            <location filename="../../revisions/project.py" />
            <source>unsaved edits</source>
            <translation>ungespeicherte Änderungen</translation>
        </message>
        <message>
            <location filename="../../revisions/project.py" />
            <source>was {place}</source>
            <translation>war {place}</translation>
        </message>
        <message>
            <location filename="../../revisions/project.py" />
            <source>{n} files, {left} of them different from Silo</source>
            <translation>{n} Dateien, {left} davon nicht wie hier in Silo</translation>
        </message>
        <message>
            <location filename="../../revisions/project.py" />
            <source>{n} BOM is held</source>
            <translation>{n} Stückliste wird zurückgehalten</translation>
        </message>
        <message>
            <location filename="../../revisions/project.py" />
            <source>{n} BOMs are held</source>
            <translation>{n} Stücklisten werden zurückgehalten</translation>
        </message>
        <message>
            <location filename="../../revisions/project.py" />
            <source>Looking at the project</source>
            <translation>Projekt wird geprüft</translation>
        </message>
        <message>
            <location filename="../../revisions/project.py" />
            <source>{place} links to {name}, which is not there.</source>
            <translation>{place} verweist auf {name}; die Datei fehlt.</translation>
        </message>
        <message>
            <location filename="../../revisions/project.py" />
            <source>{place} links to {name}, outside the project: it is not sent.</source>
            <translation>{place} verweist auf {name} außerhalb des Projekts: wird nicht gesendet.</translation>
        </message>
        <message>
            <location filename="../../revisions/project.py" />
            <source>{place} cannot be read: {name}</source>
            <translation>{place} kann nicht gelesen werden: {name}</translation>
        </message>
        <message>
            <location filename="../../revisions/project.py" />
            <source>{place} is a copy of {name}, which has the item.</source>
            <translation>{place} ist eine Kopie von {name}, zu der der Artikel gehört.</translation>
        </message>
        <message>
            <location filename="../../revisions/project.py" />
            <source>{place} is gone since its commit.</source>
            <translation>{place} ist seit dem Einchecken verschwunden.</translation>
        </message>
        <message>
            <location filename="../../revisions/pulled.py" />
            <source>{name} has edits that are not in Silo; it was left alone.</source>
            <translation>{name} hat Änderungen, die nicht in Silo sind; die Datei blieb unberührt.</translation>
        </message>
        <message>
            <location filename="../../revisions/pulled.py" />
            <source>{name} waits to be sent; it was left alone.</source>
            <translation>{name} wartet auf das Senden; die Datei blieb, wie sie ist.</translation>
        </message>
        <message>
            <location filename="../../revisions/pulled.py" />
            <source>{name} is newer than the server, which was restored from a backup; it was left alone.</source>
            <translation>{name} ist neuer als der Server, der aus einer Sicherung wiederhergestellt wurde; die Datei blieb, wie sie ist.</translation>
        </message>
        <message>
            <location filename="../../revisions/pulled.py" />
            <source>{name} is open in FreeCAD; it was left alone.</source>
            <translation>{name} ist in FreeCAD offen; die Datei blieb unberührt.</translation>
        </message>
        <message>
            <location filename="../../revisions/pulled.py" />
            <source>{path}, which {name} links to, was not fetched: {reason}</source>
            <translation>{path}, worauf {name} verweist, wurde nicht geholt: {reason}</translation>
        </message>
        <message>
            <location filename="../../session/online.py" />
            <source>No Silo server is set up yet. Enter its address in the Silo preferences.</source>
            <translation>Noch ist kein Silo-Server eingerichtet. Geben Sie seine Adresse in den Silo-Einstellungen an.</translation>
        </message>
        <message>
            <location filename="../../session/online.py" />
            <source>{file} → {number}</source>
            <translation>{file} → {number}</translation>
        </message>
        <message>
            <location filename="../../session/session.py" />
            <source>Connecting</source>
            <translation>Verbindung wird aufgebaut</translation>
        </message>
        <message>
            <location filename="../../session/session.py" />
            <source>Keeping the commit</source>
            <translation>Das Eingecheckte wird gesichert</translation>
        </message>
        <message>
            <location filename="../../session/session.py" />
            <source>The commit is kept. It is sent as soon as its file can be copied.</source>
            <translation>Es bleibt erhalten und wird gesendet, sobald die Platte eine Kopie der Datei aufnimmt.</translation>
        </message>
        <message>
            <location filename="../../session/session.py" />
            <source>Sending to Silo</source>
            <translation>Wird an Silo gesendet</translation>
        </message>
        <message>
            <location filename="../../session/session.py" />
            <source>Drawing models</source>
            <translation>Modelle werden gezeichnet</translation>
        </message>
        <message>
            <location filename="../../session/session.py" />
            <source>Outbox</source>
            <translation>Postausgang</translation>
        </message>
        <message>
            <location filename="../../session/session.py" />
            <source>Looking at held BOMs</source>
            <translation>Sieht nach zurückgehaltenen Stücklisten</translation>
        </message>
        <message>
            <location filename="../../settings/connection_test.py" />
            <source>Enter the server's address too: a token belongs to its server.</source>
            <translation>Geben Sie auch die Adresse des Servers an: Ein Token gehört zu seinem Server.</translation>
        </message>
        <message>
            <location filename="../../settings/connection_test.py" />
            <source>Enter the address of the server first.</source>
            <translation>Geben Sie zuerst die Adresse des Servers an.</translation>
        </message>
        <message>
            <location filename="../../settings/connection_test.py" />
            <source>Connected as {user} ({role}); the server is in {mode} mode.</source>
            <translation>Verbunden als {user} ({role}); der Server ist im Modus {mode}.</translation>
        </message>
        <message>
            <location filename="../../settings/connection_test.py" />
            <source>This server has no page for a login. Make a token on its account page.</source>
            <translation>Dieser Server hat keine Seite dafür. Erstellen Sie ein Token auf seiner Kontoseite.</translation>
        </message>
        <message>
            <location filename="../../settings/connection_test.py" />
            <source>No server is set up. To try it out, run: silo-mod serve</source>
            <translation>Kein Server ist eingerichtet. Zum Ausprobieren: silo-mod serve</translation>
        </message>
        <message>
            <location filename="../../settings/connection_test.py" />
            <source>from the environment variable SILO_API_URL</source>
            <translation>aus der Umgebungsvariablen SILO_API_URL</translation>
        </message>
        <message>
            <location filename="../../settings/connection_test.py" />
            <source>from this page</source>
            <translation>von dieser Seite</translation>
        </message>
        <message>
            <location filename="../../settings/connection_test.py" />
            <source>from the configuration file of silo-mod</source>
            <translation>aus der Konfigurationsdatei von silo-mod</translation>
        </message>
        <message>
            <location filename="../../settings/connection_test.py" />
            <source>Token: from the environment variable SILO_API_TOKEN.</source>
            <translation>Token: aus der Umgebungsvariablen SILO_API_TOKEN.</translation>
        </message>
        <message>
            <location filename="../../settings/connection_test.py" />
            <source>Token: from the system's keyring.</source>
            <translation>Token: aus dem Schlüsselbund des Systems.</translation>
        </message>
        <message>
            <location filename="../../settings/connection_test.py" />
            <source>Token: from FreeCAD's preferences, a plain file.</source>
            <translation>Token: aus FreeCADs Einstellungen, einer lesbaren Datei.</translation>
        </message>
        <message>
            <location filename="../../settings/connection_test.py" />
            <source>Token: from the configuration file of silo-mod.</source>
            <translation>Token: aus der Konfigurationsdatei von silo-mod.</translation>
        </message>
        <message>
            <location filename="../../settings/connection_test.py" />
            <source>Token: none.</source>
            <translation>Token: keines.</translation>
        </message>
        <message>
            <location filename="../../settings/connection_test.py" />
            <source>In use: {url} ({from}).</source>
            <translation>In Gebrauch: {url} ({from}).</translation>
        </message>
        <message>
            <location filename="../../settings/connection_test.py" />
            <source>SILO_SSL_VERIFY decides about the certificate.</source>
            <translation>SILO_SSL_VERIFY entscheidet über das Zertifikat.</translation>
        </message>
        <message>
            <location filename="../../settings/help.py" />
            <source>Help on Silo</source>
            <translation>Hilfe zu Silo</translation>
        </message>
        <message>
            <location filename="../../settings/help.py" />
            <source>The documentation is not there: {path}</source>
            <translation>Die Dokumentation fehlt: {path}</translation>
        </message>
        <message>
            <location filename="../../settings/install.py" />
            <source>Silo cannot start yet: FreeCAD's Python lacks {names}.</source>
            <translation>Silo kann noch nicht starten: FreeCADs Python fehlt {names}.</translation>
        </message>
        <message>
            <location filename="../../settings/install.py" />
            <source>Install what Silo needs</source>
            <translation>Installieren, was Silo braucht</translation>
        </message>
        <message>
            <location filename="../../settings/install.py" />
            <source>Silo needs these Python packages: {names}.
They are installed in {folder}.</source>
            <translation>Silo braucht diese Python-Pakete: {names}.
Sie werden in {folder} installiert.</translation>
        </message>
        <message>
            <location filename="../../settings/install.py" />
            <source>Install</source>
            <translation>Installieren</translation>
        </message>
        <message>
            <location filename="../../settings/install.py" />
            <source>Installing. This takes a minute or two…</source>
            <translation>Wird installiert. Das dauert ein bis zwei Minuten…</translation>
        </message>
        <message>
            <location filename="../../settings/install.py" />
            <source>The packages are in {folder}. Start FreeCAD again to use Silo.</source>
            <translation>Die Pakete sind in {folder}. Starten Sie FreeCAD neu, um Silo zu benutzen.</translation>
        </message>
        <message>
            <location filename="../../settings/install.py" />
            <source>They could not be installed: {reason}</source>
            <translation>Sie konnten nicht installiert werden: {reason}</translation>
        </message>
        <message>
            <location filename="../../settings/page.py" />
            <source>Server</source>
            <translation>Server</translation>
        </message>
        <message>
            <location filename="../../settings/page.py" />
            <source>Address</source>
            <translation>Adresse</translation>
        </message>
        <message>
            <location filename="../../settings/page.py" />
            <source>Log in…</source>
            <translation>Anmelden…</translation>
        </message>
        <message>
            <location filename="../../settings/page.py" />
            <source>API token</source>
            <translation>API-Token</translation>
        </message>
        <message>
            <location filename="../../settings/page.py" />
            <source>FreeCAD's preferences (a plain file)</source>
            <translation>FreeCADs Einstellungen (lesbare Datei)</translation>
        </message>
        <message>
            <location filename="../../settings/page.py" />
            <source>Keep the token in</source>
            <translation>Token ablegen in</translation>
        </message>
        <message>
            <location filename="../../settings/page.py" />
            <source>Check the server's certificate</source>
            <translation>Zertifikat des Servers prüfen</translation>
        </message>
        <message>
            <location filename="../../settings/page.py" />
            <source>the system's own, unless a file is given</source>
            <translation>die des Systems, wenn keine Datei angegeben ist</translation>
        </message>
        <message>
            <location filename="../../settings/page.py" />
            <source>Certificate authorities</source>
            <translation>Zertifizierungsstellen</translation>
        </message>
        <message>
            <location filename="../../settings/page.py" />
            <source>Test the connection</source>
            <translation>Verbindung testen</translation>
        </message>
        <message>
            <location filename="../../settings/page.py" />
            <source>Ask for a comment</source>
            <translation>Nach einem Kommentar fragen</translation>
        </message>
        <message>
            <location filename="../../settings/page.py" />
            <source>Sync the BOM of an assembly after its file is committed</source>
            <translation>Nach dem Einchecken einer Baugruppe ihre Stückliste abgleichen</translation>
        </message>
        <message>
            <location filename="../../settings/page.py" />
            <source>Then ask about components without a part number</source>
            <translation>Danach nach Komponenten ohne Teilenummer fragen</translation>
        </message>
        <message>
            <location filename="../../settings/page.py" />
            <source>Count standard parts (screws, nuts, washers) in the BOM</source>
            <translation>Normteile (Schrauben, Muttern, Scheiben) in der Stückliste zählen</translation>
        </message>
        <message>
            <location filename="../../settings/page.py" />
            <source>hold the BOM back until they are mended</source>
            <translation>die Stückliste zurückhalten, bis sie repariert sind</translation>
        </message>
        <message>
            <location filename="../../settings/page.py" />
            <source>sync without them (they become unreferenced)</source>
            <translation>ohne sie abgleichen (sie gelten als nicht verwendet)</translation>
        </message>
        <message>
            <location filename="../../settings/page.py" />
            <source>Where links are broken</source>
            <translation>Bei defekten Verknüpfungen</translation>
        </message>
        <message>
            <location filename="../../settings/page.py" />
            <source>Part number schema</source>
            <translation>Schema der Teilenummern</translation>
        </message>
        <message>
            <location filename="../../settings/page.py" />
            <source>Window</source>
            <translation>Fenster</translation>
        </message>
        <message>
            <location filename="../../settings/page.py" />
            <source>Show events of Silo live</source>
            <translation>Live zeigen, was in Silo geschieht</translation>
        </message>
        <message>
            <location filename="../../settings/page.py" />
            <source>Commit in the File menu of every workbench</source>
            <translation>„Einchecken“ im Datei-Menü jedes Arbeitsbereichs</translation>
        </message>
        <message>
            <location filename="../../settings/page.py" />
            <source>Reading the settings</source>
            <translation>Einstellungen werden gelesen</translation>
        </message>
        <message>
            <location filename="../../settings/page.py" />
            <source>the keyring of the system ({name})</source>
            <translation>der Schlüsselbund des Systems ({name})</translation>
        </message>
        <message>
            <location filename="../../settings/page.py" />
            <source>unchanged; enter another one to replace it</source>
            <translation>unverändert; ein neues ersetzt es</translation>
        </message>
        <message>
            <location filename="../../settings/page.py" />
            <source>none yet: make one on the server's page</source>
            <translation>noch keines: die Seite des Servers erstellt eines</translation>
        </message>
        <message>
            <location filename="../../settings/page.py" />
            <source>Keeping the token</source>
            <translation>Token wird abgelegt</translation>
        </message>
        <message>
            <location filename="../../settings/page.py" />
            <source>Asking the server…</source>
            <translation>Server wird gefragt…</translation>
        </message>
        <message>
            <location filename="../../settings/page.py" />
            <source>Testing the connection</source>
            <translation>Verbindung wird getestet</translation>
        </message>
        <message>
            <location filename="../../settings/page.py" />
            <source>Let FreeCAD in on the page that opens. It shows the code {code}.</source>
            <translation>Lassen Sie FreeCAD auf der Seite zu, die sich öffnet. Sie zeigt den Code {code}.</translation>
        </message>
        <message>
            <location filename="../../settings/page.py" />
            <source>Waiting for the browser</source>
            <translation>Warten auf den Browser</translation>
        </message>
        <message>
            <location filename="../../settings/page.py" />
            <source>You are logged in. Press OK to keep the token.</source>
            <translation>Sie sind angemeldet. „OK“ behält das Token.</translation>
        </message>
        <message>
            <location filename="../../settings/page.py" />
            <source>Asking for the login page</source>
            <translation>Anmeldeseite wird erfragt</translation>
        </message>
        <message>
            <location filename="../../start.py" />
            <source>Silo is installed more than once: {folders}. Only {used} is used; remove the others.</source>
            <translation>Silo ist mehrfach installiert: {folders}. Nur {used} wird benutzt; entfernen Sie die anderen.</translation>
        </message>
        <message>
            <location filename="../../start.py" />
            <source>Keep the BOM of an assembly in step with Silo</source>
            <translation>Hält die Stückliste einer Baugruppe mit Silo im Gleichstand</translation>
        </message>
        <message>
            <location filename="../../words.py" />
            <source>en</source>
            <translation>de</translation>
        </message>
        <message>
            <location filename="../../../bom_sync/activity_text.py" />
            <source>BOM Updated: {number}</source>
            <translation>Stückliste aktualisiert: {number}</translation>
        </message>
        <message>
            <location filename="../../../bom_sync/activity_text.py" />
            <source>+{n} added</source>
            <translation>+{n} hinzugefügt</translation>
        </message>
        <message>
            <location filename="../../../bom_sync/activity_text.py" />
            <source>~{n} qty changed</source>
            <translation>~{n} Mengen geändert</translation>
        </message>
        <message>
            <location filename="../../../bom_sync/activity_text.py" />
            <source>⚠{n} unreferenced</source>
            <translation>⚠{n} nicht verwendet</translation>
        </message>
        <message>
            <location filename="../../../bom_sync/activity_text.py" />
            <source>⚡{n} in conflict</source>
            <translation>⚡{n} im Konflikt</translation>
        </message>
        <message>
            <location filename="../../../bom_sync/activity_text.py" />
            <source>no changes</source>
            <translation>keine Änderungen</translation>
        </message>
        <message>
            <location filename="../../../bom_sync/activity_text.py" />
            <source>{n} component has no Silo part number</source>
            <translation>{n} Komponente hat keine Silo-Teilenummer</translation>
        </message>
        <message>
            <location filename="../../../bom_sync/activity_text.py" />
            <source>{n} components have no Silo part number</source>
            <translation>{n} Komponenten haben keine Silo-Teilenummer</translation>
        </message>
        <message>
            <location filename="../../../bom_sync/activity_text.py" />
            <source>This is part of draft {draft}. Revision {released} stays released as it is.</source>
            <translation>Dies gehört zum Entwurf {draft}. Revision {released} bleibt freigegeben, wie sie ist.</translation>
        </message>
        <message>
            <location filename="../../../bom_sync/activity_text.py" />
            <source>{value} for {n} of {all} parts</source>
            <translation>{value} für {n} von {all} Teilen</translation>
        </message>
        <message>
            <location filename="../../../bom_sync/activity_text.py" />
            <source>The category rules of this Silo are not used until they are mended: {problem}</source>
            <translation>Die Kategorieregeln dieses Silo gelten nicht, bis sie berichtigt sind: {problem}</translation>
        </message>
        <message>
            <location filename="../../../outbox/status_text.py" />
            <source>It is meant for {there}, which is not the server in use.</source>
            <translation>Gemeint ist {there}, nicht der verwendete Server.</translation>
        </message>
        <message>
            <location filename="../../../outbox/status_text.py" />
            <source>for another server</source>
            <translation>für einen anderen Server</translation>
        </message>
        <message>
            <location filename="../../../outbox/status_text.py" />
            <source>out of date</source>
            <translation>überholt</translation>
        </message>
        <message>
            <location filename="../../../outbox/status_text.py" />
            <source>A newer commit of it has arrived since; this one would undo it.</source>
            <translation>Neueres Eingechecktes ist inzwischen angekommen; dies würde es rückgängig machen.</translation>
        </message>
        <message>
            <location filename="../../../outbox/status_text.py" />
            <source>being copied</source>
            <translation>wird kopiert</translation>
        </message>
        <message>
            <location filename="../../../outbox/status_text.py" />
            <source>Its file is being copied.</source>
            <translation>Die Datei wird gerade kopiert.</translation>
        </message>
        <message>
            <location filename="../../../outbox/status_text.py" />
            <source>paused</source>
            <translation>angehalten</translation>
        </message>
        <message>
            <location filename="../../../outbox/status_text.py" />
            <source>tried again later</source>
            <translation>wird später wieder versucht</translation>
        </message>
        <message>
            <location filename="../../../outbox/status_text.py" />
            <source>waiting</source>
            <translation>wartet</translation>
        </message>
        <message>
            <location filename="../../../outbox/status_text.py" />
            <source>file and BOM</source>
            <translation>Datei und Stückliste</translation>
        </message>
        <message>
            <location filename="../../../outbox/status_text.py" />
            <source>file</source>
            <translation>Datei</translation>
        </message>
        <message>
            <location filename="../../../outbox/status_text.py" />
            <source>Nothing is sent to {host} before you retry: {reason}</source>
            <translation>Bis Sie es wiederholen, wird nichts an {host} gesendet: {reason}</translation>
        </message>
        <message>
            <location filename="../../../outbox/status_text.py" />
            <source>Nothing is sent to {host} for {time}: {reason}</source>
            <translation>Für {time} wird nichts an {host} gesendet: {reason}</translation>
        </message>
    </context>
    <context>
        <name>Origin_Commit</name>
        <message>
            <location filename="../../commands.py" />
            <source>Commit to Silo</source>
            <translation>In Silo einchecken</translation>
        </message>
        <message>
            <location filename="../../commands.py" />
            <source>Save this document and its changed sub-assemblies, upload them as new revisions, and bring the BOM to Silo</source>
            <translation>Dieses Dokument und seine geänderten Unterbaugruppen speichern, als neue Revisionen hochladen und die Stückliste mit Silo abgleichen</translation>
        </message>
        <message>
            <location filename="../../commands.py" />
            <source>Saves this document and the edited ones below it, uploads each as a new revision with your comment, and brings the BOM to Silo. Nothing is ever deleted there.</source>
            <translation>Speichert dieses Dokument und die geänderten darunter, lädt jedes mit Ihrem Kommentar als neue Revision hoch und gleicht die Stückliste mit Silo ab. Dort wird nie etwas gelöscht.</translation>
        </message>
    </context>
    <context>
        <name>Silo_BOM</name>
        <message>
            <location filename="../../commands.py" />
            <source>Compare BOM with Silo…</source>
            <translation>Stückliste mit Silo vergleichen…</translation>
        </message>
        <message>
            <location filename="../../commands.py" />
            <source>Show how the BOM of this assembly differs from the one in Silo</source>
            <translation>Zeigt, wie die Stückliste dieser Baugruppe von der in Silo abweicht</translation>
        </message>
    </context>
    <context>
        <name>Silo_RegisterParts</name>
        <message>
            <location filename="../../commands.py" />
            <source>Register Parts…</source>
            <translation>Teile registrieren…</translation>
        </message>
        <message>
            <location filename="../../commands.py" />
            <source>Give part numbers to the components of this assembly that have none</source>
            <translation>Den Komponenten dieser Baugruppe Teilenummern geben, die noch keine haben</translation>
        </message>
    </context>
    <context>
        <name>Silo_Mass</name>
        <message>
            <location filename="../../commands.py" />
            <source>Mass of the Assembly…</source>
            <translation>Masse der Baugruppe…</translation>
        </message>
        <message>
            <location filename="../../commands.py" />
            <source>Mass and centre of mass from the parts' shapes and materials, with what is missing</source>
            <translation>Masse und Schwerpunkt aus Formen und Werkstoffen der Teile, und was dafür fehlt</translation>
        </message>
    </context>
    <context>
        <name>Silo_Activity</name>
        <message>
            <location filename="../../commands.py" />
            <source>Database Activity</source>
            <translation>Datenbank-Aktivität</translation>
        </message>
        <message>
            <location filename="../../commands.py" />
            <source>Show events in Silo, and commits that wait to be sent</source>
            <translation>Zeigt, was in Silo geschieht und was auf das Senden wartet</translation>
        </message>
    </context>
    <context>
        <name>Silo_Open</name>
        <message>
            <location filename="../../commands.py" />
            <source>Open from Silo…</source>
            <translation>Aus Silo öffnen…</translation>
        </message>
        <message>
            <location filename="../../commands.py" />
            <source>Find an item in Silo and open its file with all that it links to</source>
            <translation>Einen Artikel in Silo finden und seine Datei mit allem öffnen, was verknüpft ist</translation>
        </message>
    </context>
    <context>
        <name>Silo_Project</name>
        <message>
            <location filename="../../commands.py" />
            <source>Project</source>
            <translation>Projekt</translation>
        </message>
        <message>
            <location filename="../../commands.py" />
            <source>All files of the project, which of them Silo has, and Commit All</source>
            <translation>Alle Dateien des Projekts, welche davon in Silo sind, und „Alle einchecken“</translation>
        </message>
    </context>
    <context>
        <name>Silo_History</name>
        <message>
            <location filename="../../commands.py" />
            <source>History…</source>
            <translation>Verlauf…</translation>
        </message>
        <message>
            <location filename="../../commands.py" />
            <source>The revisions of this document: who, when, and what changed in the BOM</source>
            <translation>Die Revisionen dieses Dokuments: wer, wann, und was sich in der Stückliste änderte</translation>
        </message>
    </context>
    <context>
        <name>Silo_Settings</name>
        <message>
            <location filename="../../commands.py" />
            <source>Silo Settings…</source>
            <translation>Silo-Einstellungen…</translation>
        </message>
        <message>
            <location filename="../../commands.py" />
            <source>Server, token, and what a commit does</source>
            <translation>Server, Token, und was beim Einchecken geschieht</translation>
        </message>
    </context>
    <context>
        <name>Silo_Help</name>
        <message>
            <location filename="../../commands.py" />
            <source>Help on Silo</source>
            <translation>Hilfe zu Silo</translation>
        </message>
        <message>
            <location filename="../../commands.py" />
            <source>Open the page that explains the commands, the pane and the messages</source>
            <translation>Die Seite öffnen, die Befehle, Fenster und Meldungen erklärt</translation>
        </message>
    </context>
    <context>
        <name>Silo_InstallPackages</name>
        <message>
            <location filename="../../settings/install.py" />
            <source>Install What Silo Needs…</source>
            <translation>Installieren, was Silo braucht…</translation>
        </message>
        <message>
            <location filename="../../settings/install.py" />
            <source>Install the Python packages that Silo needs</source>
            <translation>Die Python-Pakete installieren, die Silo braucht</translation>
        </message>
    </context>
</TS>
