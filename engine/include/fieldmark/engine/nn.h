#pragma once
/// @file
/// Includes all layers.
#include <fieldmark/engine/nn/batch_norm.h>
#include <fieldmark/engine/nn/conv2d.h>
#include <fieldmark/engine/nn/dense.h>
#include <fieldmark/engine/nn/embedding.h>
#include <fieldmark/engine/nn/group_norm.h>
#include <fieldmark/engine/nn/layer_norm.h>
