-- description: Whether causal links of a kind come from a declaration: their messages wait in the
--     node for others, for a timer or for a thread.
CREATE OR REPLACE MACRO derive.is_indirect(kind) AS
kind IN ('periodic_async', 'partial_sync', 'approximate_sync', 'queue')
