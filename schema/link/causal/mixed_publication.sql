-- description: Publications under ids that several processes share: nothing says which of these
--     processes published.
-- grain: one row per such publication
CREATE OR REPLACE MACRO derive.mixed_publication(only_run) AS TABLE
SELECT publication_id
FROM store.publication
WHERE run_id = only_run AND process_id IN (SELECT process_id FROM store.process WHERE is_ambiguous)
