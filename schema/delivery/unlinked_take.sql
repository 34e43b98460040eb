-- description: Takes whose publication is not known.
-- grain: one row per such take
CREATE OR REPLACE MACRO derive.unlinked_take(only_run) AS TABLE
SELECT t.take_id
FROM store.take AS t
ANTI JOIN store.link_transport AS l ON t.take_id = l.take_id
WHERE t.run_id = only_run
