-- description: Takes whose publication is not known.
-- grain: one row per such take
CREATE OR REPLACE MACRO derive.unlinked_take(only_run) AS TABLE
SELECT t.take_id
FROM (SELECT take_id FROM store.take WHERE run_id = only_run) AS t
ANTI JOIN store.link_transport AS l ON t.take_id = l.take_id
