#pragma once
#include <map>
#include <string>

// SHA-256 of what commit 07c747b writes in bytes_test.cpp, for each instruction set. That of AVX-512 is not
// recorded: no machine that had it was at hand.
inline const std::map<std::string, std::string> kBytesV2{
    {"code baked field", "03a73144d54aa1f633efdc52b50000951b6bf249944228d353f202fd99f32647"},
    {"code logits", "50fb7f422b269a50eefa368207fbcbdb4fd63047d4fc790688b177ca92c0b9e5"},
    {"code owner", "b7324a46e2dc584d10792f6a30687188881019f05226cc08fd2afc2bd333c431"},
    {"code renders", "82f5d385b7aaceb79e44471e7b663a600cd2219233bdfb5cbd01da2b01477fe8"},
    {"fast baked field", "6fdc3c82330eba7ba2630ae2b8c12523e2186c4b3cfe0bfaf2e7b64abe6d66e1"},
    {"fast logits", "5def8f412516b54440745c9cdf96f76d3b5c5d1a2573d6f12f0039ec83289b92"},
    {"fast owner", "e2d96145fb3aaa1cd1c6315bb2d55d84695cea8aa14c2b662d70f6a780946f26"},
    {"fast renders", "a8e0e5bae9eddd67c6ced773e3e91b7c17103f39094f74b35f5a74914dbc8911"},
    {"hash field", "67a1362c958a78061e7c9a9a636d54fe443ae6e26d4919f938dd38d88eda6067"},
    {"mlp field", "7b33409f716c7056416cecc68cb45c617c9aca7da414de414f01d9eeff7cdb82"},
    {"paper baked field", "3b747d1f497ff30375ce6302b92e2c0a1f33569d96d597bd83db312ea2494dda"},
    {"paper logits", "50fb7f422b269a50eefa368207fbcbdb4fd63047d4fc790688b177ca92c0b9e5"},
    {"paper owner", "43c69689c58d8a09006494baad077dd38433796145c622b055df1fb5e967cbab"},
    {"paper renders", "47b34fc1ca3ecbcf240095e8bd7103370c8d65b0ed75d8c7dd6065075cec3ba8"},
    {"scene", "15bf0def4f0aafd36af902743d49e9f0b84f3c33f7f1a5522020bce02dc28ac2"}};
inline const std::map<std::string, std::string> kBytesV3{
    {"code baked field", "4a007c342b63778d9f1c1edc8262d5e9904bca7ef3034349516733e7c6ed07b1"},
    {"code logits", "50fb7f422b269a50eefa368207fbcbdb4fd63047d4fc790688b177ca92c0b9e5"},
    {"code owner", "f58eaddaf918af4d4c8b98eede5d419fd16c78c6f368be43960a1f4a381d0305"},
    {"code renders", "d6feeaafd536bdedbd7e2f07871038e71286b084e2d6637ad2d6a68bffe5ade4"},
    {"fast baked field", "f24b100459d4f0580347ad541a482c12506fa7915a3f4d6d22d746efadb58e0e"},
    {"fast logits", "13700d17506fe2ce7d30fe15dd4caa20f6226b16c90f67adac9f7db525c68361"},
    {"fast owner", "97357e7a56ba9d1d5ccbede5ceaade49c059edc6b3e0c26eee069f50ac457d2c"},
    {"fast renders", "55bcb26a460edcfa2a137eb2e6ef0569c9739c90bfb42300ab3b8bf22490696a"},
    {"hash field", "b92a79ebd36803724ed1ee86eb9f8e21c76450c31e27d09081b5d1ecea5e29ef"},
    {"mlp field", "75b9aa11ccbf62dada9278d143ad378beee4521b95c4db7fe9702982666dee32"},
    {"paper baked field", "638afc0a64d00e781db823ac2a55be0ae838f7277e0bf59ce7ab9eb46fe49c28"},
    {"paper logits", "50fb7f422b269a50eefa368207fbcbdb4fd63047d4fc790688b177ca92c0b9e5"},
    {"paper owner", "ef25d43536f8d612aec01a13c8f6e0c22b40eadcce0d9164158ea79b371f24b0"},
    {"paper renders", "0eb9cf3fce60fd83ddb5b35120839947ee7874cde92ef5bf864a896ad804acb0"},
    {"scene", "15bf0def4f0aafd36af902743d49e9f0b84f3c33f7f1a5522020bce02dc28ac2"}};
